"""Makes `types.bsp`, a kernel with one segment of each of the types 1, 8, 9, 12, 13 and 21, and prints what CSPICE N0067 (spiceypy 8.3.0) reads from it.
The segment of type 21 has the difference lines of type 1.

The states of types 8 to 13 are those of an ellipse around the Earth; the difference lines of types 1 and 21 hold made numbers, since only CSPICE's
reading of them is compared.
"""
import math
import struct

import spiceypy

MU = 398600.4418


def state(t):
    """Kepler's ellipse: a = 20000 km, e = 0.4, in a plane that is inclined by 30 degrees."""
    a, e = 20000.0, 0.4
    n = math.sqrt(MU / a**3)
    E = n * t
    for _ in range(50):
        E -= (E - e * math.sin(E) - n * t) / (1 - e * math.cos(E))
    b = math.sqrt(1 - e * e)
    x, y = a * (math.cos(E) - e), a * b * math.sin(E)
    rate = n / (1 - e * math.cos(E))
    u, v = -a * math.sin(E) * rate, a * b * math.cos(E) * rate
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    return [x, c * y, s * y, u, c * v, s * v]


def line(start, order):
    """A made difference line that begins at `start`."""
    steps = [600.0 * (j + 1) for j in range(order)]
    x = state(start)
    reference = [x[0], x[3], x[1], x[4], x[2], x[5]]
    differences = [1e-4 * math.sin(3.0 * k + start) / (1 + k % order) ** 2 for k in range(3 * order)]
    return [start] + steps + reference + differences + [8.0, 7.0, 6.0, 7.0]


even = [600.0 * k for k in range(14)]
uneven = [600.0 * k + 200.0 * math.sin(5.0 * k) for k in range(14)]
ends = [600.0, 1200.0, 1800.0]
segments = []
for kind, epochs, size in [(8, even, 7), (9, uneven, 6), (9, uneven, 7), (12, even, 4), (13, uneven, 3), (13, uneven, 4)]:
    words = [x for t in epochs for x in state(t)]
    words += [0.0, 600.0] if kind in (8, 12) else epochs
    segments.append((-100 - 10 * len(segments), kind, [epochs[0], epochs[-1]], words + [size, len(epochs)]))
for kind, order in [(1, 15), (21, 15)]:
    words = [x for t in ends for x in line(t - 600.0, order)] + ends + ([order] if kind == 21 else []) + [len(ends)]
    segments.append((-100 - 10 * len(segments), kind, [0.0, ends[-1]], words))

# The file has a file record, one record of summaries, one of names, and the data.
address = 3 * 128 + 1
summaries, data = b"", b""
for target, kind, (a, b), words in segments:
    summaries += struct.pack("<2d6i", a, b, target, 399, 1, kind, address, address + len(words) - 1)
    data += struct.pack(f"<{len(words)}d", *words)
    address += len(words)
head = b"DAF/SPK " + struct.pack("<2i", 2, 6) + b"made by make.py".ljust(60) + struct.pack("<3i", 2, 2, address) + b"LTL-IEEE"
head = head.ljust(699, b"\0") + b"FTPSTR:\r:\n:\r\n:\r\0:\x81:\x10\xce:ENDFTP"
record = struct.pack("<3d", 0, 0, len(segments)) + summaries
with open("types.bsp", "wb") as f:
    f.write(head.ljust(1024, b"\0") + record.ljust(1024, b"\0") + b" " * 1024 + data)

spiceypy.furnsh("types.bsp")
for target, kind, (a, b), _ in segments:
    for part in (0.0, 0.137, 0.5, 0.905, 1.0):
        et = a + part * (b - a)
        if kind != 21:
            x, _ = spiceypy.spkgeo(target, et, "J2000", 399)
            print(f"        ({target}, {et!r}, {[float(v) for v in x]}),")
