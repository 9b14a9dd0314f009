"""Models and files of the world: random questions to Linkwork and to the reference programs. Each function returns the differences that it finds."""

import math
import tempfile
import datetime
import pathlib

import numpy as np

import common

FOLDER = pathlib.Path(tempfile.mkdtemp())


def ask(**question):
    """The answer of Linkwork; an error is a dictionary with the field `error`."""
    return common.answer().ask_json(question)


def relative(a, b):
    """The distance of two arrays relative to the larger one."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    return float(np.abs(a - b).max() / max(np.abs(b).max(), 1e-300))


def instant(rng, first=1975, last=2035):
    """A random UTC instant with milliseconds."""
    start = datetime.datetime(first, 1, 1)
    span = (datetime.datetime(last, 1, 1) - start).total_seconds()
    return start + datetime.timedelta(milliseconds=rng.randrange(int(span * 1000)))


def gravity(rng):
    """A random field, written as ICGEM or SHADR by pyshtools, at points outside of its sphere: accelerations."""
    import pyshtools

    degree, radius, mu = rng.randint(2, 40), rng.uniform(1e3, 1e8), 10 ** rng.uniform(2, 17)
    coefficients = np.zeros((2, degree + 1, degree + 1))
    for n in range(1, degree + 1):
        for m in range(n + 1):
            coefficients[0, n, m] = rng.gauss(0, 1e-3 / (n * n))
            coefficients[1, n, m] = rng.gauss(0, 1e-3 / (n * n)) if m else 0.0
    coefficients[0, 0, 0] = 1.0
    kind = rng.choice(["icgem", "shadr"])
    file = FOLDER / f"field.{'gfc' if kind == 'icgem' else 'tab'}"
    file.write_text(written(rng, kind, coefficients, mu, radius))
    if kind == "icgem":
        clm = pyshtools.SHGravCoeffs.from_file(str(file), format="icgem", quiet=True)
    else:
        clm = pyshtools.SHGravCoeffs.from_file(str(file), header_units="km")
    points, wanted = [], []
    for _ in range(5):
        r = radius * rng.uniform(1.01, 3)
        lat, lon = math.degrees(math.asin(rng.uniform(-1, 1))), rng.uniform(0, 360)
        points.append(cartesian(r, lat, lon))
        wanted.append(field_at(clm, r, lat, lon))
    told = ask(ask="gravity", format=kind, file=str(file), points=points)
    if "error" in told:
        return f"{kind}: rejected: {told['error']}"
    if relative([told["mu"], told["radius"], told["degree"]], [mu, radius, degree]) > 1e-12:
        return f"{kind}: mu, radius or degree: {told['mu']}, {told['radius']}, {told['degree']}"
    off = relative(told["accelerations"], wanted)
    return None if off < 1e-11 else f"{kind}: accelerations differ by {off:.1e}"


def written(rng, kind, coefficients, mu, radius):
    """The text of a field."""
    degree = coefficients.shape[1] - 1
    rows = [(n, m, *coefficients[:, n, m]) for n in range(degree + 1) for m in range(n + 1)]
    if kind == "shadr":
        head = f"{radius / 1e3:.17e}, {mu / 1e9:.17e}, 0.0, {degree:5d}, {degree:5d}, 1, 0.0, 0.0"
        return "\n".join([head] + [f"{n:5d},{m:5d},{c: .17e},{s: .17e}, 0.0, 0.0" for n, m, c, s in rows[1:]]) + "\n"
    exponent = rng.choice(["e", "D", "d"])
    tide = rng.choice(["tide_free", "unknown"])
    lines = [
        "product_type gravity_field",
        "modelname random",
        f"earth_gravity_constant {mu:.17e}",
        f"radius {radius:.17e}",
        f"max_degree {degree}",
        "norm fully_normalized",
        f"tide_system {tide}",
        "errors no",
        "end_of_head ====",
    ]
    if rng.random() < 0.5:
        rng.shuffle(rows)
    numbers = [f"gfc {n:4d} {m:4d} {c: .17e} {s: .17e}".replace("e", exponent) for n, m, c, s in rows]
    return "\n".join(lines + numbers) + "\n"


def cartesian(r, lat, lon):
    a, b = math.radians(lat), math.radians(lon)
    return [r * math.cos(a) * math.cos(b), r * math.cos(a) * math.sin(b), r * math.sin(a)]


def field_at(clm, r, lat, lon):
    """Acceleration in body-fixed axes by pyshtools: (radial, south, east) turned."""
    g = clm.expand(a=r, f=0.0, lat=np.array([lat]), lon=np.array([lon]), normal_gravity=False)
    radial, south, east = np.asarray(g, float).ravel()[:3]
    a, b = math.radians(lat), math.radians(lon)
    up = np.array([math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), math.sin(a)])
    down_south = np.array([math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), -math.cos(a)])
    to_east = np.array([-math.sin(b), math.cos(b), 0.0])
    return radial * up + south * down_south + east * to_east


def kernel(rng):
    """A kernel of one segment written by NAIF's toolkit, sometimes excerpted by it: states at random times and outside of the segment."""
    import spiceypy as spice

    whole, part = FOLDER / "whole.bsp", FOLDER / "part.bsp"
    for file in (whole, part):
        file.unlink(missing_ok=True)
    kind = rng.choice([2, 3, 5, 8, 9, 12, 13])
    start, step, count = rng.uniform(-1e9, 1e9), 10 ** rng.uniform(1, 5), rng.randint(12, 60)
    end = start + step * (count - 1)
    path = orbit(rng)
    times = start + step * np.arange(count)
    if kind in (9, 13):
        times[1:-1] += step * np.array([rng.uniform(-0.3, 0.3) for _ in range(count - 2)])
    times = times.tolist()
    states = [path(t) for t in times]
    handle = spice.spkopn(str(whole), "random", 0)
    arguments = (handle, 301, 399, "J2000", start, end, "segment")
    degree = rng.choice([3, 5, 7, 11])
    if kind in (2, 3):
        records = np.array([chebyshev(path, t, step, kind) for t in times[:-1]])
        order = len(records[0]) // (3 if kind == 2 else 6) - 1
        (spice.spkw02 if kind == 2 else spice.spkw03)(
            *arguments, step, len(records), order, records.ravel().tolist(), start
        )
    elif kind == 5:
        spice.spkw05(*arguments, 398600.4418, count, states, times)
    elif kind == 8:
        spice.spkw08(*arguments, degree, count, states, start, step)
    elif kind == 9:
        spice.spkw09(*arguments, degree, count, states, times)
    elif kind == 12:
        spice.spkw12(*arguments, degree, count, states, start, step)
    else:
        spice.spkw13(*arguments, degree, count, states, times)
    spice.spkcls(handle)
    file, first, last = whole, start, end
    if rng.random() < 0.5:
        # See anise #661: the summary of an excerpt begins later than its records.
        first, last = sorted(rng.uniform(start, end) for _ in range(2))
        excerpt(spice, whole, part, first, last)
        file = part
    spice.furnsh(str(file))
    inside = [first, last] + [rng.uniform(first, last) for _ in range(6)]
    wanted = []
    for t in inside:
        state = spice.spkgeo(301, t, "J2000", 399)[0]
        wanted.append([(1e3 * state[:3]).tolist(), (1e3 * state[3:]).tolist()])
    spice.kclear()
    outside = [first - 1.0, last + 1.0]
    told = ask(ask="kernel", file=str(file), target=301, centre=399, times=inside + outside)
    if "error" in told:
        return f"type {kind}: rejected: {told['error']}"
    states = told["states"]
    for t, mine, theirs in zip(inside, states, wanted):
        if isinstance(mine, str):
            return f"type {kind}: no state at {t}: {mine}"
        # Velocities from Hermite polynomials of degree 11 have the round-off errors of positions, amplified and divided
        # by the step.
        noise = 1e-12 * max(map(abs, theirs[0])) / step / max(map(abs, theirs[1]))
        off = max(relative(mine[0], theirs[0]), relative(mine[1], theirs[1]) - noise)
        if off > 1e-9:
            return f"type {kind}: states differ by {off:.1e} at {t} of {first} to {last}"
    if not all(isinstance(s, str) for s in states[len(inside) :]):
        return f"type {kind}: a state outside of the segment"
    return None


def orbit(rng):
    """A smooth path in km and km/s."""
    sizes = [rng.uniform(1e3, 1e6) for _ in range(3)]
    rates = [10 ** rng.uniform(-7, -5) for _ in range(3)]
    phases = [rng.uniform(0, 6.28) for _ in range(3)]

    def at(t):
        p = [a * math.cos(w * t + f) + 2 * a for a, w, f in zip(sizes, rates, phases)]
        v = [-a * w * math.sin(w * t + f) for a, w, f in zip(sizes, rates, phases)]
        return p + v

    return at


def chebyshev(path, start, step, kind):
    """Coefficients of a record of type 2 or 3."""
    nodes = np.cos(np.pi * (np.arange(12) + 0.5) / 12)
    values = np.array([path(start + step * (1 + x) / 2) for x in nodes])
    fits = np.polynomial.chebyshev.chebfit(nodes, values, 11)
    return fits[:, : 3 if kind == 2 else 6].T.ravel()


def excerpt(spice, whole, part, first, last):
    source = spice.dafopr(str(whole))
    spice.dafbfs(source)
    spice.daffna()
    descriptor = spice.dafgs(5)
    handle = spice.spkopn(str(part), "excerpt", 0)
    spice.spksub(source, descriptor, "part", first, last, handle)
    spice.spkcls(handle)
    spice.dafcls(source)


def earth(rng):
    """The rotation of the Earth (IAU 2006/2000A) and the scales of time, by ERFA."""
    import erfa

    t = instant(rng)
    seconds = t.second + t.microsecond / 1e6
    dut1 = rng.uniform(-0.9, 0.9)
    pole = [rng.uniform(-3e-6, 3e-6) for _ in range(2)]
    told = ask(ask="earth", epoch=text(t), dut1=dut1, pole=pole)
    if "error" in told:
        return f"rejected: {told['error']}"
    utc = erfa.dtf2d("UTC", t.year, t.month, t.day, t.hour, t.minute, seconds)
    tt = erfa.taitt(*erfa.utctai(*utc))
    ut1 = erfa.utcut1(*utc, dut1)
    sp = erfa.sp00(*tt)
    turn = erfa.c2t06a(*tt, *ut1, *pole)
    off = float(np.abs(np.array(told["rotation"]).reshape(3, 3) - turn).max())
    # An error of 1e-12 rad is 6 µm on the ground; UT1 as one f64 day fraction is accurate to 1e-16
    # d.
    if off > 3e-12:
        return f"rotation: {off:.1e} at {t} (sp {sp:.1e})"
    ahead = (told["tt"][0] - tt[0]) + (told["tt"][1] - tt[1])
    return None if abs(ahead) * 86400 < 1e-9 else f"TT: {ahead * 86400:.1e} s at {t}"


def text(t):
    return f"{t:%Y-%m-%d %H:%M:%S}.{t.microsecond // 1000:03d} UTC"


def air(rng):
    """NRLMSISE-00 by pymsis."""
    import pymsis

    t = instant(rng, 1960, 2030)
    lat, lon, km = rng.uniform(-90, 90), rng.uniform(-180, 180), rng.uniform(0, 1000)
    f107, f107_mean = rng.uniform(65, 250), rng.uniform(65, 250)
    history = rng.random() < 0.5
    ap = [rng.uniform(0, 200) for _ in range(6 if history else 1)]
    aps = [[ap[0]] + (ap if history else ap * 6)]
    wanted = pymsis.calculate(
        np.datetime64(t), lon, lat, km, [f107], [f107_mean], aps, version=0, geomagnetic_activity=-1 if history else 1
    ).ravel()
    told = ask(ask="air", epoch=text(t), place=[lat, lon, km * 1e3], f107=f107, f107_mean=f107_mean, ap=ap)
    if "error" in told:
        return f"rejected: {told['error']}"
    mine, theirs = [told["density"], told["temperature"]], [wanted[0], wanted[10]]
    off = max(relative([a], [b]) for a, b in zip(mine, theirs))
    # pymsis computes in single precision.
    return None if off < 2e-4 else f"density or temperature: {off:.1e}: {mine} and {theirs}"


def magnetic(rng):
    """IGRF-14 by ppigrf."""
    import ppigrf

    t = instant(rng, 1901, 2029)
    lat, lon, km = rng.uniform(-89.9, 89.9), rng.uniform(-180, 180), rng.uniform(0, 1000)
    east, north, up = (float(np.ravel(x)[0]) for x in ppigrf.igrf(lon, lat, km, t))
    # There is no UTC before 1960. The field does not change in a minute.
    told = ask(ask="magnetic", epoch=text(t).replace("UTC", "TT"), place=[lat, lon, km * 1e3])
    if "error" in told:
        return f"rejected: {told['error']}"
    off = float(np.abs(np.array(told["field"]) * 1e9 - [north, east, -up]).max())
    # Between the years of the table ppigrf counts days, and IAGA's program years: the difference is 0.006 nT in 2020,
    # and larger when the field changed faster.
    return None if off < 0.5 else f"{off:.2g} nT at {t}, {lat}, {lon}, {km} km"


def elements(rng):
    """Random two-line elements by python-sgp4, near the Earth and in deep space."""
    from sgp4.api import WGS72, Satrec

    motion = rng.uniform(0.5, 16)
    inclination, eccentricity = rng.uniform(0, 180), rng.choice([rng.uniform(0, 0.02), rng.uniform(0, 0.7)])
    angles = [rng.uniform(0, 360) for _ in range(3)]
    drag = f"{rng.randint(0, 99999):05d}-{rng.randint(3, 6)}"
    day = rng.uniform(1, 366)
    number = rng.choice(["    5", "25544", "A5544", "00900"])
    one = f"1 {number}U 98067A   {rng.randint(0, 24):02d}{day:012.8f}  .00000000  00000-0  {drag} 0    1"
    two = f"2 {number} {inclination:8.4f} {angles[0]:8.4f} {int(eccentricity * 1e7):07d} {angles[1]:8.4f} {angles[2]:8.4f} {motion:11.8f}    1"
    lines = [line.ljust(68) + str(checksum(line)) for line in (one, two)]
    minutes = [0.0] + [rng.uniform(-2000, 20000) for _ in range(4)]
    theirs = Satrec.twoline2rv(*lines, WGS72)
    wanted = [theirs.sgp4_tsince(m) for m in minutes]
    told = ask(ask="elements", lines=lines, minutes=minutes)
    if "error" in told:
        return None if all(w[0] for w in wanted) else f"rejected: {told['error']}: {lines}"
    for m, mine, (fault, r, v) in zip(minutes, told["states"], wanted):
        if fault or isinstance(mine, str):
            if bool(fault) != isinstance(mine, str):
                return f"{m} min: {mine}, error {fault} of python-sgp4: {lines}"
            continue
        # The epoch has microseconds, in which the body moves by 8 mm.
        off = float(np.abs(np.array(mine[0]) / 1e3 - r).max())
        if off > 2e-5:
            return f"{off:.1e} km at {m} min: {lines}"
    return None


def checksum(line):
    return sum(int(c) if c.isdigit() else c == "-" for c in line) % 10


CASES = {
    "gravity": gravity,
    "kernel": kernel,
    "earth": earth,
    "air": air,
    "magnetic": magnetic,
    "elements": elements,
}
