"""The OpenGL engine, through moderngl: any GPU, or Mesa's software rasteriser, without a window (DESIGN section 8)."""
