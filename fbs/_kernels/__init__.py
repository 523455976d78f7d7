"""Blocks, batched linear algebra and BLAS threads: what the solvers of this package stand on."""
