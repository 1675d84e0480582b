"""Time, memory and accuracy: `fsci bench`."""
