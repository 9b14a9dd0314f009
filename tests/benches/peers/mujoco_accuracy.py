"""Where MuJoCo's bodies end after a second of sliding, spinning and rolling, beside the converged end.

The scenes are those of framework/solvers/tests/contact_accuracy.rs, whose converged ends (steps of 10 us, solved to
1e-11) stand below; the rolling ball has a closed form. The scene of boxes that push each other is left out: it has
impacts, which a soft contact makes partly elastic.
"""

import mujoco
import numpy as np

ENDS = {"spinning": (0.757775, 0.160949, 0.05), "rolling": (1.995740, 0.799148, 0.1)}
SCENES = {
    "spinning": (0.3, '<geom type="box" size="0.2 0.1 0.05" mass="2"', 0.05, (2, 0.5, 0), (0, 0, 6)),
    "rolling": (0.25, '<geom type="sphere" size="0.1" mass="1.5"', 0.1, (3, 1, 0), (0, -20, 3)),
}
CONES = {
    "pyramidal (default)": "",
    "elliptic": 'cone="elliptic"',
    "elliptic, impratio 100": 'cone="elliptic" impratio="100"',
}


def end(name: str, options: str, step: float) -> np.ndarray:
    """Position of the body after one second (m)."""
    friction, geom, height, velocity, spin = SCENES[name]
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{step}" {options}/><worldbody>
        <geom type="plane" size="10 10 1" friction="{friction} 0 0"/>
        <body pos="0 0 {height}"><freejoint/>{geom} friction="{friction} 0 0" condim="3"/></body>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qvel[:] = [*velocity, *spin]
    for _ in range(round(1 / step)):
        mujoco.mj_step(model, data)
    return np.array(data.qpos[:3])


for cone, options in CONES.items():
    for name, converged in ENDS.items():
        away = [np.linalg.norm(end(name, options, h) - converged) for h in (1e-3, 2e-3)]
        print(f"{name:9} {cone:23} 1 ms {away[0]:.1e} m   2 ms {away[1]:.1e} m")
