# SPDX-License-Identifier: Apache-2.0
"""Parts of the module Brainshift of 3D Slicer. label, grid and colours are its core: numpy and vtk alone, nothing of Slicer.
scene holds the nodes that show a field.

They lie in a folder of their own because Slicer takes every .py file of a module path for a module.
"""
