"""Makes the STL files of this folder, for the view: surfaces of revolution in the axes of their bodies, m.

Cabin and heat shield are those of the masses in sim.ron; canopies are bowls of two thirds of their nominal diameter, the three main ones side by
side, leaning outwards. Run in this folder: python3 shapes.py
"""

import math
import struct

SEGMENTS = 24


def cabin():
    """The profile (radius, height), from the axis outward and back to it: a solid."""
    return [(0.0, -0.9), (1.9, -0.9), (2.15, -0.6), (2.1, -0.45), (0.85, 1.3), (0.8, 1.5), (0.0, 1.5)]


def heat_shield():
    bowl = [(2.25 * k / 6, -1.35 + 0.3 * (k / 6) ** 2) for k in range(7)]
    return [*bowl, (2.25, -0.95), (0.0, -1.0)]


def canopy(diameter):
    """A bowl, open below, 5 cm thick; its origin in the middle of its height."""
    radius = diameter / 3
    around = [k * math.pi / 2 / 8 for k in range(9)]
    outside = [(radius * math.cos(a), radius * (0.8 * math.sin(a) - 0.4)) for a in around]
    inside = [(max(r - 0.05, 0.0), z - 0.05) for r, z in outside]
    return [*reversed(inside), *outside]


def revolved(profile):
    """Triangles, counter-clockwise from outside where the profile has the solid on its left, seen with r to the right and z up."""
    at = lambda r, z, k: (r * math.cos(2 * math.pi * k / SEGMENTS), r * math.sin(2 * math.pi * k / SEGMENTS), z)
    for (r0, z0), (r1, z1) in zip(profile, profile[1:]):
        for k in range(SEGMENTS):
            a, b, c, d = at(r0, z0, k), at(r0, z0, k + 1), at(r1, z1, k + 1), at(r1, z1, k)
            if r0 > 0:
                yield a, b, c
            if r1 > 0:
                yield a, c, d


def leaning(triangles, turn):
    """One of three canopies: 22 degrees outwards about a point 30 m below."""
    (s, c), (st, ct) = ((math.sin(x), math.cos(x)) for x in (math.radians(22), turn))

    def moved(p):
        x, y, z = p[0], p[1], p[2] + 30.0
        x, z = c * x + s * z, c * z - s * x - 30.0 * c
        return (ct * x - st * y, st * x + ct * y, z)

    for triangle in triangles:
        yield tuple(moved(p) for p in triangle)


def write(name, triangles):
    triangles = list(triangles)
    with open(name, "wb") as file:
        file.write(name.encode().ljust(80) + struct.pack("<I", len(triangles)))
        for t in triangles:
            u, v = ([p - q for p, q in zip(t[k], t[0])] for k in (1, 2))
            n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            size = math.sqrt(sum(x * x for x in n)) or 1.0
            file.write(struct.pack("<12fH", *(x / size for x in n), *t[0], *t[1], *t[2], 0))


if __name__ == "__main__":
    write("cabin.stl", revolved(cabin()))
    write("heat_shield.stl", revolved(heat_shield()))
    write("drogue.stl", revolved(canopy(10.0)))
    write("main.stl", (t for k in range(3) for t in leaning(revolved(canopy(31.7)), 2 * math.pi * k / 3)))
