"""The mesh benchmark: contenders of one job, measured in turns in one process.

`report.bench(BenchOptions(…), path)` measures, prints and saves; `mesh.run(BenchOptions(…))` only measures.
"""
