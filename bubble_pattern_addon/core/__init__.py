"""The method of Bubble Pattern: target region -> bubbles -> features -> solid.

Nothing in this package imports Blender; it needs numpy, scipy, trimesh and manifold3d only.
"""
