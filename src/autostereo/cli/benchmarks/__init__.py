"""The mesh benchmark: contenders of one job, measured in turns in one process."""
