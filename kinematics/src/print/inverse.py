def _within(value: float, lower: float, upper: float) -> float:
    if value < lower:
        return lower
    if value > upper:
        return upper
    if value == value:
        return value
    return lower if lower > 0.0 or upper < 0.0 else 0.0


def _turning(m: list[list[float]]) -> tuple[list[float], float]:
    """The rotation vector of a matrix, and its angle."""
    w = [0.5 * (m[2][1] - m[1][2]), 0.5 * (m[0][2] - m[2][0]), 0.5 * (m[1][0] - m[0][1])]
    sine = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    cosine = 0.5 * (m[0][0] + m[1][1] + m[2][2] - 1.0)
    angle = math.atan2(sine, cosine)
    if not cosine <= -0.9:
        factor = angle / sine if sine > 0.0 else 1.0
        return [w[0] * factor, w[1] * factor, w[2] * factor], angle
    # Near half a turn, the sine says little of the axis: the greatest column of (1 - cos) a aT does.
    most = 0
    for at in (1, 2):
        if m[at][at] > m[most][most]:
            most = at
    axis = [0.5 * (m[at][most] + m[most][at]) - (cosine if at == most else 0.0) for at in range(3)]
    square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]
    along = axis[0] * w[0] + axis[1] * w[1] + axis[2] * w[2]
    factor = (-angle if along < 0.0 else angle) / math.sqrt(square)
    return [axis[0] * factor, axis[1] * factor, axis[2] * factor], angle


def _way(target: list[list[float]], pose: list[float], length: float) -> tuple[list[float], float, float]:
    """The way from a pose to its target: metres, then radians times `length`."""
    x, y, z = (target[row][3] - pose[4 * row + 3] for row in range(3))
    turn: list[list[float]] = []
    for row in range(3):
        a, b, c = target[row][:3]
        turn.append([0.0 + a * pose[at] + b * pose[at + 1] + c * pose[at + 2] for at in (0, 4, 8)])
    (u, v, w), angle = _turning(turn)
    way = [x, y, z, u * length, v * length, w * length]
    return way, math.sqrt(x * x + y * y + z * z), angle


def _solve(matrix: list[list[float]], vector: list[float]) -> None:
    """Solves a symmetric positive system in place, by Cholesky's method."""
    for row in range(6):
        line = matrix[row]
        for column in range(row + 1):
            other = matrix[column]
            value = line[column]
            for at in range(column):
                value -= line[at] * other[at]
            if row == column:
                line[row] = math.sqrt(max(value, 1e-300))
            else:
                line[column] = value / other[column]
        value = vector[row]
        for at in range(row):
            value -= line[at] * vector[at]
        vector[row] = value / line[row]
    for row in range(5, -1, -1):
        value = vector[row]
        for at in range(row + 1, 6):
            value -= matrix[at][row] * vector[at]
        vector[row] = value / matrix[row][row]


def _nearest_of(
    closed: list[list[float]], turns: list[float], lower: list[float], upper: list[float], first: list[float]
) -> list[list[float]]:
    """Positions of a closed form within limits, brought near by whole turns, the nearest ones first."""
    kept: list[tuple[float, list[float]]] = []
    for found in closed:
        if not all(math.isfinite(one) for one in (*found, *first)):
            continue
        far = 0.0
        for joint, turn in enumerate(turns):
            start = _within(first[joint], lower[joint], upper[joint])
            found[joint] += turn * math.floor((start - found[joint]) / turn + 0.5)
            if found[joint] > upper[joint]:
                found[joint] -= turn
            elif found[joint] < lower[joint]:
                found[joint] += turn
            far += (found[joint] - first[joint]) * (found[joint] - first[joint])
        if all(low <= one <= high for one, low, high in zip(found, lower, upper)):
            kept.append((far, found))
    kept.sort(key=lambda one: one[0])
    return [found for _, found in kept]


def _search(
    motion: Callable[[list[float]], tuple[list[float], list[list[float]]]],
    target: list[list[float]],
    near: float,
    turned: float,
    lower: list[float],
    upper: list[float],
    endless: list[bool],
    closed: list[list[float]],
    turns: list[float],
    starts: list[list[float]],
    iterations: int,
    first: list[float],
) -> tuple[list[float], bool, float, float, int]:
    """Positions in which a frame has a pose, whether it has, how far it is, and the computations of the motion."""
    joints = range(len(first))
    length = near / turned
    count, least = 0, math.inf
    best: tuple[list[float], bool, float, float] = (first, False, math.inf, math.inf)
    for start in [*_nearest_of(closed, turns, lower, upper, first), first, *starts]:
        at = [_within(start[joint], lower[joint], upper[joint]) for joint in joints]
        if count == 0:
            best = (at, False, math.inf, math.inf)
        pose, jacobian = motion(at)
        count += 1
        error, distance, angle = _way(target, pose, length)
        cost = sum(part * part for part in error)
        damping = 0.1
        for _ in range(1, iterations):
            if distance <= near and angle <= turned:
                break
            # A joint at a limit that would go on is left alone.
            weighted = [*jacobian[:3], *([part * length for part in row] for row in jacobian[3:])]
            free: list[int] = []
            for joint in joints:
                slope = 0.0
                for row in range(6):
                    slope += weighted[row][joint] * error[row]
                if not (slope < 0.0 and at[joint] <= lower[joint] or slope > 0.0 and at[joint] >= upper[joint]):
                    free.append(joint)
            matrix = [[0.0] * 6 for _ in range(6)]
            for row in range(6):
                for other in range(row + 1):
                    value = 0.0
                    for joint in free:
                        value += weighted[row][joint] * weighted[other][joint]
                    matrix[row][other] = value
            # In a direction in which no joint moves, more than rounding is left.
            rest = 2.0 * math.ulp(1.0) * sum(matrix[row][row] for row in range(6))
            for row in range(6):
                matrix[row][row] += damping * cost + rest
            pull = list(error)
            _solve(matrix, pull)
            trial, longest = list(at), 0.0
            for joint in free:
                step = 0.0
                for row in range(6):
                    step += weighted[row][joint] * pull[row]
                trial[joint] = _within(at[joint] + step, lower[joint], upper[joint])
                longest = max(longest, abs(trial[joint] - at[joint]))
            if not longest > 1e-12:
                break
            pose, new_jacobian = motion(trial)
            count += 1
            new_error, new_distance, new_angle = _way(target, pose, length)
            new_cost = sum(part * part for part in new_error)
            if new_cost < cost:
                is_flat = cost - new_cost < 1e-4 * cost
                at, jacobian, cost = trial, new_jacobian, new_cost
                error, distance, angle = new_error, new_distance, new_angle
                damping *= 0.3
                if is_flat:
                    break
            else:
                damping *= 3.0
        reached = distance <= near and angle <= turned
        if reached or cost < least:
            least, best = cost, (at, reached, distance, angle)
        if reached:
            break
    at, reached, distance, angle = best
    is_turned = False
    for joint in joints:
        if endless[joint] and abs(at[joint] - first[joint]) < 1e9:
            whole = math.floor((at[joint] - first[joint]) / math.tau + 0.5)
            at[joint] -= whole * math.tau
            is_turned = is_turned or whole != 0
    if is_turned:
        # Positions have fewer digits far from 0.
        _, distance, angle = _way(target, motion(at)[0], length)
        count, reached = count + 1, distance <= near and angle <= turned
    return at, reached, distance, angle, count


def _rates(
    jacobian: list[list[float]],
    wish: list[float],
    damped: float,
    preferred: list[float],
    least: list[float],
    most: list[float],
) -> tuple[list[float], list[float]]:
    """The velocities x of joints within limits with the least |J x - v|^2 + d^2 |x - p|^2, and J x.

    p is the part of the preferred velocities that does not move the frame.
    """
    joints = range(len(preferred))
    matrix, pull = [[0.0] * 6 for _ in range(6)], [0.0] * 6
    for row in range(6):
        for joint in joints:
            part = jacobian[row][joint]
            pull[row] += part * preferred[joint]
            for other in range(row + 1):
                matrix[row][other] += part * jacobian[other][joint]
    # In a direction in which no joint moves, more than rounding is left.
    size = sum(matrix[row][row] for row in range(6))
    rest = 2.0 * math.ulp(1.0) * size
    damping = damped * damped + rest
    for row in range(6):
        matrix[row][row] += 1e-9 + rest
    _solve(matrix, pull)
    for row in range(6):
        preferred = [preferred[joint] - jacobian[row][joint] * pull[row] for joint in joints]
    velocities = [_within(preferred[joint], least[joint], most[joint]) for joint in joints]
    # 0: free; -1 and 1: at the least and the greatest velocity.
    held = [0] * len(preferred)
    for _ in range(8 * len(preferred)):
        matrix = [[0.0] * 6 for _ in range(6)]
        pull = list(wish)
        for row in range(6):
            for joint in joints:
                part = jacobian[row][joint]
                pull[row] -= part * (velocities[joint] if held[joint] else preferred[joint])
                if not held[joint]:
                    for other in range(row + 1):
                        matrix[row][other] += part * jacobian[other][joint]
            matrix[row][row] += damping
        _solve(matrix, pull)
        # On the way to the best velocities of free joints, the first limit holds its joint.
        way, wanted = 1.0, list(velocities)
        first: int | None = None
        for joint in joints:
            if held[joint]:
                continue
            wanted[joint] = preferred[joint]
            for row in range(6):
                wanted[joint] += jacobian[row][joint] * pull[row]
            change = wanted[joint] - velocities[joint]
            limit = most[joint] if change > 0.0 else least[joint]
            if wanted[joint] > limit if change > 0.0 else wanted[joint] < limit:
                share = (limit - velocities[joint]) / change
                if first is None or share < way:
                    way, first = share, joint
        for joint in joints:
            if not held[joint]:
                velocities[joint] += way * (wanted[joint] - velocities[joint])
        if first is not None:
            is_most = wanted[first] > most[first]
            held[first] = 1 if is_most else -1
            velocities[first] = most[first] if is_most else least[first]
            continue
        # A joint that is better off without its limit is free again.
        error = list(wish)
        speed = 0.0
        for row in range(6):
            speed += abs(error[row])
            for joint in joints:
                part = jacobian[row][joint] * velocities[joint]
                error[row] -= part
                speed += abs(part)
        gain = 1e-12 + math.ulp(1.0) * math.sqrt(size) * speed
        last: int | None = None
        for joint in joints:
            if not held[joint] or least[joint] == most[joint]:
                continue
            slope = damping * (preferred[joint] - velocities[joint])
            for row in range(6):
                slope += jacobian[row][joint] * error[row]
            if -slope * held[joint] > gain:
                gain, last = -slope * held[joint], joint
        if last is None:
            break
        held[last] = 0
    velocities = [_within(velocities[joint], least[joint], most[joint]) for joint in joints]
    achieved = [0.0 + sum(row[joint] * velocities[joint] for joint in joints) for row in jacobian]
    return velocities, achieved
