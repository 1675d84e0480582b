"""Why a step failed or a run is slow: `fsci explain`."""
