"""Compares changes of frames with those of pinocchio: `moving.py FILE`. Prints how many there were."""

import csv
import sys

import numpy as np
import pinocchio as pin

DIRECTIONS = {"ahead": (1, 0, 0), "left": (0, 1, 0), "right": (0, -1, 0), "up": (0, 0, 1)}
UNITS = {"mm": 1e-3, "m": 1.0, "mm/s": 1e-3, "m/s": 1.0, "deg/s": np.pi / 180, "rad/s": 1.0, "N": 1.0, "kN": 1e3, "N*m": 1.0, "m/s^2": 1.0}


def body(axes):
    """Takes coordinates in these axes to ahead, left, up."""
    return np.array([DIRECTIONS[direction] for direction in axes.split()], dtype=float).T


def vector(axes, unit, numbers, is_axial=False):
    turn = body(axes)
    return (np.linalg.det(turn) if is_axial else 1.0) * turn @ (np.array(numbers) * UNITS[unit])


def along(axes, unit, vector, is_axial=False):
    turn = body(axes)
    return (np.linalg.det(turn) if is_axial else 1.0) * turn.T @ vector / UNITS[unit]


def moved(kind, transform, ends, numbers):
    """The numbers at the other end."""
    (axes, one, other), (wanted, to_one, to_other) = ends
    first = vector(axes, one, numbers[:3], kind in ("spin", "torque"))
    if kind in ("speed", "spin", "push", "force", "torque"):
        return along(wanted, to_one, transform.rotation @ first, kind in ("spin", "torque"))
    if kind == "point":
        return along(wanted, to_one, transform.act(first))
    second = vector(axes, other, numbers[3:], True)
    if kind == "twist":
        there = transform.act(pin.Motion(first, second))
    else:
        there = transform.act(pin.Force(first, second))
    return np.concatenate([along(wanted, to_one, there.linear), along(wanted, to_other, there.angular, True)])


def matrix(axes, quaternion):
    turn = body(axes)
    return turn @ pin.Quaternion(np.array(quaternion)).matrix() @ turn.T


def pose(ends, transform, numbers):
    """Position and rotation at the other end, in its axes and unit."""
    (axes, one, _), (wanted, to_one, _) = ends
    placed = transform * pin.SE3(matrix(axes, numbers[3:]), vector(axes, one, numbers[:3]))
    turn = body(wanted)
    return along(wanted, to_one, placed.translation), turn.T @ placed.rotation @ turn


def near(found, expected, tolerance, what):
    size = max(np.abs(expected).max(), 1.0)
    worst = np.abs(np.array(found) - expected).max()
    assert worst <= tolerance * size, (what, worst, found, expected)


def of_pose(kind, transform, ends, numbers, spread, found):
    _, one, other = kind.split("_")
    place, turn = pose(ends, transform, numbers)
    near(found[:3], place, 1e-12, kind)
    near(pin.Quaternion(np.array(found[3:7])).matrix(), turn, 1e-12, kind)
    own = pin.Quaternion(np.array(numbers[3:])).matrix()
    jacobian = np.zeros((6, 6))
    step = 1e-6
    for column in range(6):
        ahead_and_back = []
        for by in (step, -step):
            error = np.zeros(6)
            error[column] = by
            small = pin.exp3(error[3:])
            shaken = small @ own if one == "fixed" else own @ small
            position = np.array(numbers[:3]) + error[:3]
            there, whole = pose(ends, transform, [*position, *pin.Quaternion(shaken).coeffs()])
            small = whole @ turn.T if other == "fixed" else turn.T @ whole
            ahead_and_back.append(np.concatenate([there - place, pin.log3(small)]))
        jacobian[:, column] = (ahead_and_back[0] - ahead_and_back[1]) / (2 * step)
    near(np.reshape(found[7:], (6, 6)), jacobian @ spread @ jacobian.T, 1e-7, kind)


def body_of(numbers):
    mass, x, y, z, xx, xy, xz, yy, yz, zz = numbers
    return mass, np.array([x, y, z]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def of_inertia(transform, ends, numbers, found):
    """Masses in g and kg, lengths in mm and m, tensors in kg*m^2."""
    (axes, _, _), (wanted, _, _) = ends
    own, there = body(axes), body(wanted)
    mass, centre, tensor = body_of(numbers)
    known = pin.Inertia(mass / 1e3, own @ centre / 1e3, own @ tensor @ own.T)
    moved = transform.act(known)
    mass, centre, tensor = body_of(found)
    near([mass], np.array([moved.mass]), 1e-12, "mass")
    near(centre, there.T @ moved.lever, 1e-12, "centre")
    near(tensor, there.T @ moved.inertia @ there, 1e-12, "tensor")
    # The same by the adjoint: X* I X^-1 of the spatial inertia.
    adjoint = transform.toDualActionMatrix() @ known.matrix() @ transform.toActionMatrixInverse()
    spatial = pin.Inertia(mass, there @ centre, there @ tensor @ there.T).matrix()
    near(spatial, adjoint, 1e-11, "adjoint")


checked = 0
with open(sys.argv[1], newline="") as file:
    for kind, own, wanted, *words in csv.reader(file):
        ends = own.split("|"), wanted.split("|")
        numbers = [float(word) for word in words]
        rows, numbers = np.reshape(numbers[:12], (3, 4)), numbers[12:]
        transform = pin.SE3(rows[:, :3], rows[:, 3])
        if kind == "inertia":
            of_inertia(transform, ends, numbers[:10], numbers[10:])
        elif kind.startswith("pose"):
            of_pose(kind, transform, ends, numbers[:7], np.reshape(numbers[7:43], (6, 6)), numbers[43:])
        else:
            side = 6 if kind in ("twist", "wrench") else 3
            cells = side * side
            own, spread, found = numbers[:side], numbers[side : side + cells], numbers[side + cells :]
            zero = moved(kind, transform, ends, np.zeros(side))
            jacobian = np.array([moved(kind, transform, ends, unit) - zero for unit in np.eye(side)]).T
            near(found[:side], moved(kind, transform, ends, own), 1e-12, kind)
            expected = jacobian @ np.reshape(spread, (side, side)) @ jacobian.T
            near(np.reshape(found[side:], (side, side)), expected, 1e-12, kind)
        checked += 1
print(checked)
