"""Checks lines of rc-quantity: `oracle.py units|rotations|motions FILE`. Prints how many there were."""

import csv
import sys
from itertools import groupby

import numpy as np


def units(rows):
    import pint

    registry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    # The gauss of pint is that of the Gaussian system, which has another dimension.
    registry.define("gauss_of_si = 1e-4 tesla")
    # Units that this table and pint name differently; of those without a name in pint, the product.
    names = {
        "1": "dimensionless", "%": "percent", "‰": "permille", "ppb": "ppm", "ft": "foot", "mi": "mile", "nmi": "nautical_mile",
        "ha": "hectare", "L": "liter", "t": "tonne", "lb": "pound", "oz": "ounce", "min": "minute", "d": "day",
        "wk": "week", "Bd": "baud", "arcmin": "arcminute", "arcsec": "arcsecond", "rev": "revolution",
        "gon": "grade", "kn": "knot", "g_0": "standard_gravity", "kgf": "kilogram_force", "lbf": "pound_force",
        "atm": "standard_atmosphere", "Torr": "torr", "Wh": "watt_hour", "VA": "volt_ampere", "Ah": "ampere_hour",
        "hp": "horsepower", "cal": "calorie", "Ω": "ohm", "G": "gauss_of_si", "°C": "degC", "°F": "degF", "B": "byte",
        "px": "pixel", "rpm": "revolutions_per_minute", "Sym": "dimensionless", "dB": "dimensionless", "h": "hour", "in": "inch",
        "yd": "yard", "psi": "pound_force_per_square_inch", "C": "coulomb", "F": "farad", "H": "henry", "S": "siemens", "T": "tesla",
        "deg": "degree", "eV": "electron_volt", "bar": "bar", "dyn": "dyne", "mph": "mile_per_hour",
    }
    count = 0
    for one, other, value in rows:
        source, target = (names.get(name, name) for name in (one, other))
        factor = 12.5
        if one == "ppb":
            factor /= 1e3
        expected = registry.Quantity(factor, source).to(target).magnitude
        if other == "ppb":
            expected *= 1e3
        assert abs(float(value) - expected) <= 1e-12 * abs(expected) + 1e-12, (one, other, value, expected)
        count += 1
    return count


def rotations(rows):
    from scipy.spatial.transform import Rotation
    from transforms3d.axangles import axangle2mat
    from transforms3d.euler import euler2mat
    from transforms3d.quaternions import quat2mat

    count = 0
    for (axes, turns), group in groupby(rows, key=lambda row: (row[0], row[1])):
        numbers = np.array([[float(number) for number in row[2:]] for row in group])
        angles, matrices, quaternions, axis, angle, vectors, back = np.split(numbers, [3, 12, 16, 19, 20, 23], axis=1)
        matrices = matrices.reshape(-1, 3, 3)
        order = axes if turns == "s" else axes.upper()

        def near(found, expected, what):
            worst = np.abs(found - expected).max()
            assert worst < 1e-12, (order, what, worst)

        theirs = Rotation.from_euler(order, angles)
        near(matrices, theirs.as_matrix(), "matrix of scipy")
        their_quaternions = theirs.as_quat()
        sign = np.sign((their_quaternions * quaternions).sum(axis=1, keepdims=True))
        near(quaternions * sign, their_quaternions, "quaternion of scipy")
        near(Rotation.from_rotvec(vectors).as_matrix(), matrices, "rotation vector of scipy")
        near(Rotation.from_euler(order, back).as_matrix(), matrices, "angles of scipy")
        near(np.linalg.norm(axis, axis=1), 1.0, "length of the axis")
        assert (angle >= 0).all() and (angle <= np.pi + 1e-15).all()
        near(np.array([euler2mat(*three, turns + axes) for three in angles]), matrices, "matrix of transforms3d")
        near(np.array([euler2mat(*three, turns + axes) for three in back]), matrices, "angles of transforms3d")
        near(np.array([quat2mat(np.roll(q, 1)) for q in quaternions]), matrices, "quaternion of transforms3d")
        turned = [axangle2mat(a, t[0], is_normalized=True) for a, t in zip(axis, angle)]
        near(np.array(turned), matrices, "axis and angle of transforms3d")
        count += len(numbers)
    return count


def motions(rows):
    from pytransform3d.transformations import adjoint_from_transform, transform_from

    count = 0
    for row in rows:
        numbers = np.array([float(number) for number in row[1:]])
        rotation, translation, spatial, twist, wrench = np.split(numbers, [9, 12, 18, 24])
        adjoint = adjoint_from_transform(transform_from(rotation.reshape(3, 3), translation))
        assert np.abs(adjoint @ spatial - twist).max() < 1e-12
        # Torque and force are dual: the power with a twist is the same in both frames.
        assert np.abs(np.linalg.inv(adjoint).T @ spatial - wrench).max() < 1e-12
        count += 1
    return count


with open(sys.argv[2], encoding="utf-8", newline="") as lines:
    print(globals()[sys.argv[1]](list(csv.reader(lines))))
