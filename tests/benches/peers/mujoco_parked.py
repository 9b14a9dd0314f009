"""A six-wheel rocker-bogie rover, brakes on, parked on slopes in MuJoCo (PyPI `mujoco`): does it creep?

The same numbers as assemblies/rovers/rocker_bogie.ron in mass and size, wheels welded to their arms
(brakes), the two rockers coupled by an equality (differential). The slope is a turned gravity, 3.71
m/s². After ten seconds of settling, the drift of the chassis over sixty more is printed, for the
default contact and for the one that the manual advises against slip (elliptic cones, impratio).
"""
import math

import mujoco

MARS = 3.71
WHEELS = {"f": 1.095, "m": -0.089, "r": -1.163}


def wheel(name, x, y, z):
    return f"""
      <body name="{name}" pos="{x} {y} {z}">
        <geom type="cylinder" size="0.25 0.2" euler="1.5708 0 0" mass="18" friction="0.7 0.005 0.0001"/>
      </body>"""


def side(name, y):
    """A rocker with the front wheel, and on it a bogie with the other two."""
    return f"""
    <body name="rocker_{name}" pos="0.1 {0.9 * y} 0">
      <joint name="rocker_{name}" type="hinge" axis="0 1 0"/>
      <geom type="box" size="0.5 0.04 0.04" mass="25" contype="0" conaffinity="0"/>
      {wheel(f"wf_{name}", WHEELS["f"] - 0.1, 0.17 * y, -0.35)}
      <body name="bogie_{name}" pos="-0.7 0 -0.1">
        <joint name="bogie_{name}" type="hinge" axis="0 1 0"/>
        <geom type="box" size="0.4 0.04 0.04" mass="15" contype="0" conaffinity="0"/>
        {wheel(f"wm_{name}", WHEELS["m"] + 0.6, 0.17 * y, -0.25)}
        {wheel(f"wr_{name}", WHEELS["r"] + 0.6, 0.17 * y, -0.25)}
      </body>
    </body>"""


def model(slope_deg, option):
    s = math.radians(slope_deg)
    return f"""
<mujoco>
  <option timestep="0.001" integrator="implicitfast" gravity="{-MARS * math.sin(s)} 0 {-MARS * math.cos(s)}" {option}/>
  <worldbody>
    <geom type="plane" size="50 50 1" friction="0.7 0.005 0.0001"/>
    <body name="chassis" pos="0 0 0.61">
      <freejoint/>
      <geom type="box" size="0.8 0.6 0.2" pos="0 0 0.35" mass="708" contype="0" conaffinity="0"/>
      {side("l", 1.0)}
      {side("r", -1.0)}
    </body>
  </worldbody>
  <equality><joint joint1="rocker_l" joint2="rocker_r" polycoef="0 -1 0 0 0"/></equality>
</mujoco>"""


def creep(slope_deg, option, settle=10.0, watch=60.0):
    """Drift of the chassis down the slope, mm a minute; None when it left the ground or tipped."""
    m = mujoco.MjModel.from_xml_string(model(slope_deg, option))
    d = mujoco.MjData(m)
    mujoco.mj_step(m, d, nstep=round(settle / m.opt.timestep))
    start = d.qpos[:3].copy()
    mujoco.mj_step(m, d, nstep=round(watch / m.opt.timestep))
    if not math.isfinite(d.qpos[0]) or abs(d.qpos[2]) > 1.5:
        return None
    return 1e3 * math.dist(d.qpos[:3], start) * 60.0 / watch


if __name__ == "__main__":
    options = {"default": "", "elliptic, impratio 10": 'cone="elliptic" impratio="10"',
               "elliptic, impratio 100": 'cone="elliptic" impratio="100"'}
    for name, option in options.items():
        for slope in (0, 5, 10, 20):
            drift = creep(slope, option)
            text = "fell" if drift is None else f"{drift:.4f} mm/min"
            print(f"mujoco parked {slope:2d} deg, {name}: {text}", flush=True)
