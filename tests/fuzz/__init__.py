"""A fuzzer of the readers and of the splicer: damaged files, and the promises that hold whatever a file says.

``python -m fuzz --help`` (in the folder ``tests``) hunts, guided by coverage; the tests replay the corpus and a few
thousand mutations of it.
"""
