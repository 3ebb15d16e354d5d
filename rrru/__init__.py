"""Robot calibration, and diagnosis of the errors that remain after it."""
