"""Makes heat_shield.stl and backshell.stl, for the view: surfaces of revolution in the axes of the stage, m.

The heat shield is the blunt cone of the aerodynamics: 70 degrees, 4.5 m wide, a nose of half its radius, the tip at z = -2.75. The backshell is
two cones from its rim up to where the parachute is packed. Run in this folder: python3 aeroshell.py
"""

import math
import struct

SEGMENTS = 48
RIM, NOSE, TIP, HALF = 2.25, 1.125, -2.75, math.radians(70)


def heat_shield():
    """The profile (radius, height), from the axis outward and back to it: a solid."""
    ball = [(NOSE * math.sin(a), TIP + NOSE * (1 - math.cos(a))) for a in (k * (math.pi / 2 - HALF) / 4 for k in range(5))]
    r, z = ball[-1]
    rim = z + (RIM - r) / math.tan(HALF)
    return [*ball, (RIM, rim), (RIM, rim + 0.06), (0.0, rim - 0.12)]


def backshell():
    """A shell 4 cm thick, open below."""
    rim = heat_shield()[-2][1]
    outside = [(RIM, rim), (RIM, rim + 0.1), (1.85, 0.72), (0.9, 1.15), (0.0, 1.15)]
    inside = [(max(r - 0.04, 0.0), z - (0.04 if z > 0.5 else 0.0)) for r, z in outside]
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


def write(name, profile):
    triangles = list(revolved(profile))
    with open(name, "wb") as file:
        file.write(name.encode().ljust(80) + struct.pack("<I", len(triangles)))
        for t in triangles:
            u, v = ([p - q for p, q in zip(t[k], t[0])] for k in (1, 2))
            n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            size = math.sqrt(sum(x * x for x in n)) or 1.0
            file.write(struct.pack("<12fH", *(x / size for x in n), *t[0], *t[1], *t[2], 0))


if __name__ == "__main__":
    write("heat_shield.stl", heat_shield())
    write("backshell.stl", backshell())
