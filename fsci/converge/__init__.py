"""The error of a case's own values, by runs of coarser and finer levels: the command `fsci converge`."""
