"""Multibody dynamics, spatial operator expressions, robot models, simulations and logs.

>>> import linkwork
>>> arm = linkwork.load("arm.urdf")
>>> tau = arm.inverse_dynamics(q, v, vdot)
>>> vdot = arm.forward_dynamics(q, v, tau)
>>> M = arm.mass_matrix(q)

Arrays are numpy float64, in SI units and radians. Vectors are in world axes unless stated
otherwise; spatial vectors have the angular part first; quaternions are [x y z w].
Errors raise `LinkworkError`. Its message states where the mistake is, what is wrong, and the remedy.
`__cpu__` is the processor level for which the loaded build of the compiled module was made.
"""

from pathlib import Path as _Path

from . import _choose

_choose.load(__name__, _Path(__file__).parent)

from ._linkwork import (  # noqa: E402
    Builder,
    Calibration,
    Campaign,
    Collider,
    Collisions,
    ConstrainedMotion,
    Constraint,
    Contact,
    ContactStep,
    Edit,
    Frames,
    Grip,
    Hinge,
    Identifiable,
    InverseKinematicsSearch,
    LinkworkError,
    Log,
    Mechanism,
    Modes,
    Operator,
    Operators,
    Outcome,
    Rank,
    RateTarget,
    Report,
    Results,
    Robot,
    Series,
    Simulation,
    State,
    Subgraph,
    Subhinge,
    Target,
    Trajectory,
    Variable,
    WholeBodyForces,
    __cpu__,
    __version__,
    load,
    read_log,
    support_margin,
    support_polygon,
)
from .live import Attached, attach  # noqa: E402

__all__ = [
    "Attached",
    "Builder",
    "Calibration",
    "Campaign",
    "Collider",
    "Collisions",
    "ConstrainedMotion",
    "Constraint",
    "Contact",
    "ContactStep",
    "Edit",
    "Frames",
    "Grip",
    "Hinge",
    "Identifiable",
    "InverseKinematicsSearch",
    "LinkworkError",
    "Log",
    "Mechanism",
    "Modes",
    "Operator",
    "Operators",
    "Outcome",
    "Rank",
    "RateTarget",
    "Report",
    "Results",
    "Robot",
    "Series",
    "Simulation",
    "State",
    "Subgraph",
    "Subhinge",
    "Target",
    "Trajectory",
    "Variable",
    "WholeBodyForces",
    "__cpu__",
    "__version__",
    "attach",
    "load",
    "read_log",
    "support_margin",
    "support_polygon",
]
