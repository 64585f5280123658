#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the three meshes of this folder (Python's standard library only): python3 make_meshes.py"""
import itertools
import math


def box(cells, size):
    """Nodes, tetrahedra: six per cube, all along its diagonal (Kuhn)."""
    nx, ny, nz = cells
    nodes = [(size[0] * i / nx, size[1] * j / ny, size[2] * k / nz)
             for k in range(nz + 1) for j in range(ny + 1) for i in range(nx + 1)]
    index = lambda c: c[0] + (nx + 1) * (c[1] + (ny + 1) * c[2])
    tets = []
    for order in itertools.permutations(range(3)):
        for corner in itertools.product(range(nx), range(ny), range(nz)):
            at, tet = list(corner), [index(corner)]
            for axis in order:
                at[axis] += 1
                tet.append(index(at))
            tets.append(tet)
    return nodes, oriented(nodes, tets)


def octant(radii, cells):
    """The octant x, y, z >= 0 of a thick sphere in shells."""
    points, triangles, first = [], [], []
    for i in range(cells + 1):
        first.append(len(points))
        for j in range(i + 1):
            polar, azimuth = math.pi / 2 * i / cells, math.pi / 2 * j / i if i else 0.0
            points.append((0.0 if j == i and i else math.sin(polar) * math.cos(azimuth),
                           0.0 if j == 0 else math.sin(polar) * math.sin(azimuth),
                           0.0 if i == cells else math.cos(polar)))
    for i in range(cells):
        up, low = first[i], first[i + 1]
        triangles += [(up + j, low + j, low + j + 1) for j in range(i + 1)]
        triangles += [(up + j, low + j + 1, up + j + 1) for j in range(i)]
    nodes = [tuple(r * c for c in p) for r in radii for p in points]
    tets = []
    for shell in range(len(radii) - 1):
        for triangle in triangles:
            a, b, c = (shell * len(points) + v for v in sorted(triangle))
            A, B, C = a + len(points), b + len(points), c + len(points)
            tets += [[a, b, c, C], [a, b, B, C], [a, A, B, C]]
    return nodes, oriented(nodes, tets)


def oriented(nodes, tets):
    for tet in tets:
        (x0, y0, z0), *rest = (nodes[v] for v in tet)
        (a, b, c), (d, e, f), (g, h, i) = ((x - x0, y - y0, z - z0) for x, y, z in rest)
        if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0:
            tet[2], tet[3] = tet[3], tet[2]
    return tets


def boundary(tets):
    faces = {}
    for tet in tets:
        for face in itertools.combinations(tet, 3):
            key = tuple(sorted(face))
            faces[key] = None if key in faces else face
    return [face for face in faces.values() if face]


def write_msh(path, nodes, tets, volume, surfaces):
    """Gmsh 2.2 ASCII. surfaces: name -> predicate of a point, for all three corners of a face."""
    elements = [(4, 1, tet) for tet in tets]
    faces = boundary(tets)
    for tag, holds in enumerate(surfaces.values(), 2):
        elements += [(2, tag, f) for f in faces if all(holds(nodes[v]) for v in f)]
    with open(path, "w") as out:
        out.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n%d\n3 1 \"%s\"\n"
                  % (len(surfaces) + 1, volume))
        for tag, name in enumerate(surfaces, 2):
            out.write('2 %d "%s"\n' % (tag, name))
        out.write("$EndPhysicalNames\n$Nodes\n%d\n" % len(nodes))
        for number, node in enumerate(nodes, 1):
            out.write("%d %.12g %.12g %.12g\n" % ((number,) + node))
        out.write("$EndNodes\n$Elements\n%d\n" % len(elements))
        for number, (kind, tag, corners) in enumerate(elements, 1):
            out.write("%d %d 2 %d %d %s\n" % (number, kind, tag, tag,
                                              " ".join(str(v + 1) for v in corners)))
        out.write("$EndElements\n")


def write_vtu(path, nodes, tets, labels):
    def array(kind, name, values, components=""):
        return '<DataArray type="%s" Name="%s"%s format="ascii">%s</DataArray>\n' % (
            kind, name, components, " ".join(values))
    with open(path, "w") as out:
        out.write('<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" '
                  'byte_order="LittleEndian">\n<UnstructuredGrid>\n<Piece NumberOfPoints="%d" '
                  'NumberOfCells="%d">\n<Points>\n' % (len(nodes), len(tets)))
        out.write(array("Float64", "Points", ["%.12g" % c for n in nodes for c in n],
                        ' NumberOfComponents="3"'))
        out.write("</Points>\n<Cells>\n")
        out.write(array("Int64", "connectivity", [str(v) for t in tets for v in t]))
        out.write(array("Int64", "offsets", [str(4 * i + 4) for i in range(len(tets))]))
        out.write(array("UInt8", "types", ["10"] * len(tets)))
        out.write("</Cells>\n<CellData>\n" + array("Int32", "label", [str(l) for l in labels]))
        out.write("</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")


def main():
    radius = lambda p: math.sqrt(sum(c * c for c in p))
    nodes, tets = octant([10.0 * 2.0 ** (k / 5) for k in range(6)], 12)
    write_msh("thick_sphere.msh", nodes, tets, "wall",
              {"cavity": lambda p: radius(p) < 10.001, "plane_x": lambda p: p[0] == 0.0,
               "plane_y": lambda p: p[1] == 0.0, "plane_z": lambda p: p[2] == 0.0})
    nodes, tets = box((3, 3, 3), (10.0, 10.0, 10.0))
    write_msh("signorini_block.msh", nodes, tets, "block",
              {"bottom": lambda p: p[2] == 0.0, "top": lambda p: p[2] == 10.0,
               "plane_x": lambda p: p[0] == 0.0, "plane_y": lambda p: p[1] == 0.0})
    nodes, tets = box((2, 2, 8), (20.0, 20.0, 60.0))
    labels = [1 if sum(nodes[v][2] for v in t) < 4 * 30.0 else 2 for t in tets]
    write_vtu("layered_column.vtu", nodes, tets, labels)


if __name__ == "__main__":
    main()
