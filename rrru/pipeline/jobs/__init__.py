"""Jobs of one campaign. The workflow runs each as a process of its own, the library and the command one after another.

A module has the function that computes a job's frames from its settings, and `main`, which reads the job's input files
and writes its output files. Settings are those of `rrru.pipeline.config`.
"""
