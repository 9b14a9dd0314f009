"""Makes `conics.bsp`, a kernel with segments of the types 5 and 17, and prints what CSPICE N0067 (spiceypy 8.3.0) reads from it: the states of a Kepler
orbit that is disturbed at each epoch (type 5: an ellipse, and a hyperbola), and the elements of a moon (type 17)."""
import math
import struct

import spiceypy

MU = 398600.4418


def ellipse(k):
    """A state near a perigee, which differs from a two-body motion from epoch to epoch."""
    t = 700.0 * k + 150.0 * math.sin(3.0 * k)
    a, e = 20000.0 + 40.0 * k, 0.4
    n = math.sqrt(MU / a**3)
    E = n * t
    for _ in range(50):
        E -= (E - e * math.sin(E) - n * t) / (1 - e * math.cos(E))
    b = math.sqrt(1 - e * e)
    x, y = a * (math.cos(E) - e), a * b * math.sin(E)
    rate = n / (1 - e * math.cos(E))
    u, v = -a * math.sin(E) * rate, a * b * math.cos(E) * rate
    c, s = math.cos(0.5), math.sin(0.5)
    return t, [x, c * y, s * y, u, c * v, s * v]


def fast(k):
    """States of a fly-by."""
    t = 900.0 * (k - 2)
    return t, [9000.0 + 0.5 * t, 11.0 * t, -2000.0 + 0.3 * t, 0.5 + 1e-4 * t, 11.0 - 1e-4 * t, 0.3]


segments = []
for states in ([ellipse(k) for k in range(7)], [fast(k) for k in range(5)]):
    words = [x for _, s in states for x in s] + [t for t, _ in states] + [MU, len(states)]
    segments.append((-200 - 10 * len(segments), 5, [states[0][0], states[-1][0]], words))
moon = [1000.0, 27000.0, 0.11, -0.23, 1.9, 0.05, 0.31, 3e-7, 1.4e-4, -2e-7, 0.7, 1.1]
segments.append((-220, 17, [-5e6, 5e6], moon))
# This segment is large: it has more than a hundred states and a directory of epochs.
many = [ellipse(k / 20) for k in range(141)]
words = [x for _, s in many for x in s] + [t for t, _ in many] + [many[99][0], MU, len(many)]
segments.append((-230, 5, [many[0][0], many[-1][0]], words))

address = 3 * 128 + 1
summaries, data = b"", b""
for target, kind, (a, b), words in segments:
    summaries += struct.pack("<2d6i", a, b, target, 399, 1, kind, address, address + len(words) - 1)
    data += struct.pack(f"<{len(words)}d", *words)
    address += len(words)
head = b"DAF/SPK " + struct.pack("<2i", 2, 6) + b"made by make_conics.py".ljust(60) + struct.pack("<3i", 2, 2, address) + b"LTL-IEEE"
head = head.ljust(699, b"\0") + b"FTPSTR:\r:\n:\r\n:\r\0:\x81:\x10\xce:ENDFTP"
record = struct.pack("<3d", 0, 0, len(segments)) + summaries
with open("conics.bsp", "wb") as f:
    f.write(head.ljust(1024, b"\0") + record.ljust(1024, b"\0") + b" " * 1024 + data.ljust(-(-len(data) // 1024) * 1024, b"\0"))

spiceypy.furnsh("conics.bsp")
for target, kind, (a, b), _ in segments:
    for part in (0.0, 0.137, 0.5, 0.905, 1.0):
        et = a + part * (b - a)
        x, _ = spiceypy.spkgeo(target, et, "J2000", 399)
        print(f"        ({target}, {et!r}, {[float(v) for v in x]}),")
