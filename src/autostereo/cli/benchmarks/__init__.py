"""The benchmarks: contenders of one job, measured in turns in one process.

`report.bench(name, BenchOptions(…), path)` measures, prints and saves; `mesh.run(BenchOptions(…))`, and likewise of
`volume`, `points` and `papers`, only measures.
"""
