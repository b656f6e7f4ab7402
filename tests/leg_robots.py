"""URDF texts of small robots whose legs are not six times three joints."""

from __future__ import annotations

import math
from pathlib import Path

import hexapod_pin as hp

COXA, FEMUR, TIBIA = 0.05, 0.10, 0.12  # lengths [m]
RADIUS = 0.01  # of the feet [m]
NAMES = {
    4: ("lf", "lr", "rf", "rr"),
    5: ("l1", "l2", "l3", "r1", "r2"),
    6: ("lf", "lm", "lr", "rf", "rm", "rr"),
    7: ("l1", "l2", "l3", "l4", "r1", "r2", "r3"),
    8: ("l1", "l2", "l3", "l4", "r1", "r2", "r3", "r4"),
}


def link(name: str, mass: float, size: float, centre: tuple[float, ...] = (0.0, 0.0, 0.0)) -> str:
    """Return a link with the inertia of a cube; massless without a mass."""
    if not mass:
        return f'<link name="{name}"/>\n'
    moment = mass * size**2 / 6.0
    moments = " ".join(f'{k}="{moment!r}"' for k in ("ixx", "iyy", "izz"))
    return (
        f'<link name="{name}"><inertial><origin xyz="{" ".join(map(str, centre))}"/>'
        f'<mass value="{mass}"/><inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial></link>\n'
    )


def joint(
    name: str, parent: str, child: str, xyz: tuple[float, ...], *, axis: str = "",
    rpy: str = "0 0 0", kind: str = "revolute", limits: tuple[float, float] = (-1.6, 1.6),
    effort: float = 6.0, velocity: float = 10.0,
) -> str:  # fmt: skip
    """Return a joint; fixed without an axis."""
    kind = kind if axis else "fixed"
    moves = f'<axis xyz="{axis}"/><limit lower="{limits[0]}" upper="{limits[1]}" '
    moves = f'{moves}effort="{effort}" velocity="{velocity}"/>' if axis else ""
    place = " ".join(map(str, xyz))
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}" rpy="{rpy}"/>{moves}</joint>\n'
    )


def hips(count: int) -> dict[str, tuple[float, float, float]]:
    """Return x, y [m] and yaw [rad] of the hips: even counts on two sides, odd ones around."""
    names = NAMES[count]
    if count % 2:
        side = (count + 1) // 2
        order = [*names[:side], *reversed(names[side:])]
        turn = {name: 2.0 * math.pi * k / count for k, name in enumerate(order)}
        return {n: (0.12 * math.cos(turn[n]), 0.12 * math.sin(turn[n]), turn[n]) for n in names}
    rows = count // 2
    places = {}
    for k, name in enumerate(names):
        sign, row = (1.0 if k < rows else -1.0), k % rows
        x = 0.12 - 0.24 * row / (rows - 1)
        splay = 0.0 if count > 6 else math.atan2(x, 0.2)
        places[name] = (x * (rows - 1) / 1.5, sign * 0.07, sign * (math.pi / 2 - splay))
    return places


def legged(
    count: int = 6, *, joints: int = 3, tarsus: float | None = None, pan: bool = False,
    spring: bool = False, tarsus_place: float | None = None, order: tuple[str, ...] = (),
) -> str:  # fmt: skip
    """Return the URDF of a robot with its legs stated, in an order of their elements.

    Each leg walks with 2 or 3 joints. A fourth, the tarsus, is held at an angle [rad] or fixed at a
    place [rad]; `spring` puts feet on held sliding joints, `pan` a head on a held joint.
    """
    body, elements = [link("base_link", 2.0, 0.15)], {}
    for name, (x, y, yaw) in hips(count).items():
        chain, text = _leg(name, (x, y, 0.0), yaw, joints, tarsus, tarsus_place, spring)
        body.append(text)
        elements[name] = f'<leg name="{name}" joints="{" ".join(chain)}" foot="{name}_foot"/>\n'
        posture = {"coxa": 0.0, "femur": -0.3, "tibia": 1.6 if tarsus is None else 1.2}
        if joints == 2:
            posture = {"coxa": 0.0, "femur": 0.1}
        for part, angle in posture.items():
            elements[name] += f'<posture joint="{name}_{part}_joint" angle="{angle}"/>\n'
        if tarsus is not None:
            elements[name] += f'<held joint="{name}_tarsus_joint" position="{tarsus}"/>\n'
        if spring:
            elements[name] += f'<held joint="{name}_spring_joint" position="0"/>\n'
    if pan:
        body.append(joint("pan_joint", "base_link", "head", (0.1, 0.0, 0.05), axis="0 0 1"))
        body.append(link("head", 0.2, 0.05, (0.03, 0.0, 0.0)))
        elements["pan"] = '<held joint="pan_joint" position="0.4"/>\n'
    stated = "".join(elements[name] for name in (order or tuple(elements)))
    return (
        f'<robot name="legged{count}"><hexapod_pin title="test" source="test">\n'
        f"{stated}</hexapod_pin>\n{''.join(body)}</robot>\n"
    )


def _leg(
    name: str, hip: tuple[float, ...], yaw: float, joints: int, tarsus: float | None,
    place: float | None, spring: bool,
) -> tuple[list[str], str]:  # fmt: skip
    chain = [f"{name}_coxa_joint", f"{name}_femur_joint", f"{name}_tibia_joint"][:joints]
    limits = (-1.5, 2.5)
    text = joint(chain[0], "base_link", f"{name}_coxa", hip, axis="0 0 1", rpy=f"0 0 {yaw!r}")
    text += link(f"{name}_coxa", 0.05, 0.03, (COXA / 2, 0.0, 0.0))
    text += joint(chain[1], f"{name}_coxa", f"{name}_femur", (COXA, 0.0, 0.0), axis="0 1 0",
                  limits=limits)  # fmt: skip
    text += link(f"{name}_femur", 0.08, 0.04, (FEMUR / 2, 0.0, 0.0))
    if joints == 2:
        text += joint(f"{name}_knee", f"{name}_femur", f"{name}_tibia", (FEMUR, 0.0, 0.0),
                      rpy="0 1.5 0")  # fmt: skip
    else:
        text += joint(chain[2], f"{name}_femur", f"{name}_tibia", (FEMUR, 0.0, 0.0), axis="0 1 0",
                      limits=limits)  # fmt: skip
    text += link(f"{name}_tibia", 0.06, 0.04, (TIBIA / 2, 0.0, 0.0))
    last, length = f"{name}_tibia", TIBIA
    if tarsus is not None or place is not None:
        fixed = tarsus is None
        text += joint(f"{name}_tarsus_joint", last, f"{name}_tarsus", (TIBIA / 2, 0.0, 0.0),
                      axis="" if fixed else "0 1 0", rpy=f"0 {place or 0.0!r} 0")  # fmt: skip
        text += link(f"{name}_tarsus", 0.02, 0.03, (TIBIA / 4, 0.0, 0.0))
        last, length = f"{name}_tarsus", TIBIA / 2
    if spring:
        text += joint(f"{name}_spring_joint", last, f"{name}_shank", (length, 0.0, 0.0),
                      axis="1 0 0", kind="prismatic", limits=(-0.02, 0.02), effort=200.0,
                      velocity=5.0)  # fmt: skip
        text += link(f"{name}_shank", 0.01, 0.01)
        last, length = f"{name}_shank", 0.0
    text += joint(f"{name}_foot_joint", last, f"{name}_foot", (length, 0.0, 0.0))
    ball = f'<sphere radius="{RADIUS}"/>'
    text += f'<link name="{name}_foot"><collision><geometry>{ball}</geometry></collision></link>\n'
    return chain, text


def load(text: str, folder: Path) -> hp.Robot:
    path = folder / "robot.urdf"
    path.write_text(text)
    return hp.load_robot(path)


def offset_robot(folder: Path) -> hp.Robot:
    old, new = (f'<origin xyz="0.0835 {aside} 0" rpy="0 0 0"/>' for aside in ("0", "0.012"))
    return load(hp.urdf_path("kharagpur").read_text().replace(old, new), folder)
