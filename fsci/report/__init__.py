"""A run on one page: `fsci report`."""
