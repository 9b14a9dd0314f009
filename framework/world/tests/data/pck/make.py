"""Makes `rotations.bpc`, a binary PCK with segments of type 2, and prints the rotations that CSPICE N0067 (spiceypy 8.3.0) reads from it.

Body 31001 has angles in axes of J2000, like the Moon's principal axes, and a second, later segment that overlaps the first. Body 3000 has
angles in axes of the ecliptic of J2000, like ITRF93. The coefficients are made numbers, since only CSPICE's reading of them is compared.
"""
import math
import os

import spiceypy

FILE = "rotations.bpc"
DAY = 86400.0


def records(begin, length, count, rates, seed):
    """Coefficients of phi, delta, w for each interval; the first two of each angle follow a constant rate."""
    out = []
    for k in range(count):
        middle = begin + (k + 0.5) * length
        for axis, (start, rate) in enumerate(rates):
            out += [start + rate * middle, rate * 0.5 * length]
            out += [1e-3 * math.sin(7.0 * seed + 3.0 * axis + k + 11.0 * j) / 3.0**j for j in range(5)]
    return out


if os.path.exists(FILE):
    os.remove(FILE)
handle = spiceypy.pckopn(FILE, "rotations", 0)
moon = [(0.1, 1e-9), (0.4, -2e-9), (2.0, 2.66e-6)]
earth = [(1.2, -3e-12), (0.41, 5e-12), (0.7, 7.292e-5)]
start = 7000 * DAY
for body, frame, begin, length, count, rates in [
    (31001, "J2000", start, 4 * DAY, 3, moon),
    (31001, "J2000", start + 10 * DAY, 2 * DAY, 4, moon),
    (3000, "ECLIPJ2000", start, DAY, 2, earth),
]:
    numbers = records(begin, length, count, rates, body % 10 + count)
    per = 7
    spiceypy.pckw02(handle, body, frame, begin, begin + length * count, f"segment of {body}", length, count, per - 1,
                    numbers, begin)
spiceypy.pckcls(handle)
spiceypy.furnsh(FILE)
for body, days in [(31001, 0.0), (31001, 3.3), (31001, 4.0), (31001, 11.7), (31001, 13.1), (31001, 18.0), (3000, 0.25), (3000, 1.9)]:
    et = start + days * DAY
    m = spiceypy.tisbod("J2000", body, et)
    # A record has the rows of the rotation from the body to J2000, and the angular velocity in
    # J2000.
    rotation, omega = spiceypy.xf2rav(m)
    rows = [float(rotation[j][i]) for i in range(3) for j in range(3)]
    print(f"({body}, {et!r}, {rows}, {[float(x) for x in omega]}),")
