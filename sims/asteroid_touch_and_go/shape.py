"""Makes asteroid.obj (for gravity) and asteroid.stl (for contact and the viewer), and prints where the site is.

An icosahedron whose faces are cut into 16, each point at r(direction): a spinning top with a ridge at its equator and waves of low
degree, scaled to the mean radius. Run in this folder: python3 shape.py
"""

import math
import struct

RADIUS = 245.0  # mean, m


def unit(p):
    n = math.sqrt(sum(x * x for x in p))
    return tuple(x / n for x in p)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def icosphere(cuts):
    g = (1 + math.sqrt(5)) / 2
    points = [unit(p) for p in [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
                                (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
             (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(cuts):
        middles = {}

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append(unit(tuple(x + y for x, y in zip(points[a], points[b]))))
            return middles[key]

        faces = [f for a, b, c in faces for ab, bc, ca in [(middle(a, b), middle(b, c), middle(c, a))]
                 for f in [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]]
    return points, faces


def radius(d):
    x, y, z = d
    ridge = 0.07 * math.exp(-((z / 0.25) ** 2))
    top = -0.05 * z * z
    waves = 0.02 * x * y + 0.025 * x * (5 * z * z - 1) + 0.02 * y * (x * x - 3 * z * z) + 0.015 * (x**4 - 6 * x * x * y * y + y**4)
    return RADIUS * (1 + ridge + top + waves)


points, faces = icosphere(2)
points = [tuple(round(radius(p) * x, 3) for x in p) for p in points]

with open("asteroid.obj", "w") as out:
    out.write("# made by shape.py, m\n")
    out.writelines("v %.3f %.3f %.3f\n" % p for p in points)
    out.writelines("f %d %d %d\n" % (a + 1, b + 1, c + 1) for a, b, c in faces)

with open("asteroid.stl", "wb") as out:
    out.write(b"made by shape.py, m".ljust(80) + struct.pack("<I", len(faces)))
    for a, b, c in faces:
        p, q, r = points[a], points[b], points[c]
        n = unit(cross(minus(q, p), minus(r, p)))
        out.write(struct.pack("<12fH", *n, *p, *q, *r, 0))

volume = sum(dot(points[a], cross(points[b], points[c])) for a, b, c in faces) / 6
print("faces %d, volume %.4e m3, radius of the ball of this volume %.2f m" % (len(faces), volume, (0.75 * volume / math.pi) ** (1 / 3)))

# The site is the middle of the face whose normal is nearest to 45 deg north, 30 deg east; its x axis points east, its z
# axis along the normal.
want = (math.cos(math.radians(45)) * math.cos(math.radians(30)), math.cos(math.radians(45)) * math.sin(math.radians(30)), math.sin(math.radians(45)))


def middle_of(face):
    return tuple(sum(points[k][i] for k in face) / 3 for i in range(3))


site = max(faces, key=lambda f: dot(unit(middle_of(f)), want))
a, b, c = (points[k] for k in site)
z = unit(cross(minus(b, a), minus(c, a)))
x = unit(cross((0, 0, 1), z))
y = cross(z, x)
w = math.sqrt(1 + x[0] + y[1] + z[2]) / 2
quat = ((y[2] - z[1]) / (4 * w), (z[0] - x[2]) / (4 * w), (x[1] - y[0]) / (4 * w), w)
print("site position: [%.4f, %.4f, %.4f]" % middle_of(site))
print("site rotation: (quat: [%.12f, %.12f, %.12f, %.12f])" % quat)
print("angle of the normal to the direction from the centre: %.2f deg" % math.degrees(math.acos(dot(z, unit(middle_of(site))))))
