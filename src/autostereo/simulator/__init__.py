"""Multi-view rasterisation hardware, as a functional simulator (Hasselgren and Akenine-Möller 2006)."""
