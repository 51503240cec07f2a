"""The specification and test oracle: NumPy in float64, slow, obviously right."""
