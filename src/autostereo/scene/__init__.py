"""What is to be seen: frozen dataclasses of NumPy arrays."""
