//! The loops of inverse solvers, over slices that the caller lends: no allocation, no dependency.
//!
//! Positions are found by a damped Gauss-Newton method on the manifold of poses
//! (T. Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method",
//! 2011), whose steps leave joints alone that would pass a limit. Velocities are the least squares
//! within limits, by an active set.

/// A frame that shall be somewhere.
pub struct Aim<'a> {
    /// Where it shall be: the homogeneous matrix for columns.
    pub target: &'a [[f64; 4]; 4],
    /// How far it may be from there, in m.
    pub near: f64,
    /// By which angle it may be turned, in rad. `near / turned` metres count as much as a radian.
    pub turned: f64,
    /// The least positions. An infinite one is not a limit.
    pub lower: &'a [f64],
    /// The greatest positions.
    pub upper: &'a [f64],
    /// The joints that are equal after a whole turn. Their positions are within half a turn of the
    /// first ones.
    pub endless: &'a [bool],
    /// Where the search begins, before it begins at the positions of the caller: positions after positions.
    pub closed: &'a [f64],
    /// Where the search begins again, if it found nothing: positions after positions.
    pub starts: &'a [f64],
    /// How often the motion is computed at most after each beginning.
    pub iterations: usize,
}

/// The result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Whether the frame is within the tolerance of its target.
    pub reached: bool,
    /// How far the frame is from its target, in m.
    pub distance: f64,
    /// By which angle it is turned, in rad.
    pub angle: f64,
    /// How often the motion was computed.
    pub iterations: usize,
}

/// Numbers that [`pose`] and [`velocity`] need for so many joints.
pub const fn room(joints: usize) -> usize {
    2 * (12 + 6 * joints) + 4 * joints
}

/// The nearest number between two limits.
pub fn within(value: f64, lower: f64, upper: f64) -> f64 {
    if value < lower {
        lower
    } else if value > upper {
        upper
    } else if value == value {
        value
    } else if lower > 0.0 || upper < 0.0 {
        lower
    } else {
        0.0
    }
}

/// The rotation vector of a matrix, and its angle.
fn turning(m: &[[f64; 3]; 3]) -> ([f64; 3], f64) {
    let w = [
        0.5 * (m[2][1] - m[1][2]),
        0.5 * (m[0][2] - m[2][0]),
        0.5 * (m[1][0] - m[0][1]),
    ];
    let sine = f64::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    let cosine = 0.5 * (m[0][0] + m[1][1] + m[2][2] - 1.0);
    let angle = f64::atan2(sine, cosine);
    if cosine > -0.9 {
        let factor = if sine > 0.0 { angle / sine } else { 1.0 };
        return ([w[0] * factor, w[1] * factor, w[2] * factor], angle);
    }
    // Near half a turn, the sine says little of the axis: the greatest column of (1 - cos) a aT does.
    let mut most = 0;
    for at in 1..3 {
        if m[at][at] > m[most][most] {
            most = at;
        }
    }
    let mut axis = [0.0; 3];
    let (mut square, mut along) = (0.0, 0.0);
    for at in 0..3 {
        axis[at] = 0.5 * (m[at][most] + m[most][at]);
        if at == most {
            axis[at] -= cosine;
        }
        square += axis[at] * axis[at];
        along += axis[at] * w[at];
    }
    let factor = if along < 0.0 { -angle } else { angle } / f64::sqrt(square);
    (
        [axis[0] * factor, axis[1] * factor, axis[2] * factor],
        angle,
    )
}

/// The way from a pose to its target: metres, then radians times `length`. With distance and angle.
fn way(target: &[[f64; 4]; 4], pose: &[f64], length: f64) -> ([f64; 6], f64, f64) {
    let mut way = [0.0; 6];
    let mut turn = [[0.0; 3]; 3];
    for row in 0..3 {
        way[row] = target[row][3] - pose[4 * row + 3];
        for column in 0..3 {
            for at in 0..3 {
                turn[row][column] += target[row][at] * pose[4 * column + at];
            }
        }
    }
    let distance = f64::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    let (vector, angle) = turning(&turn);
    for at in 0..3 {
        way[3 + at] = vector[at] * length;
    }
    (way, distance, angle)
}

/// The sum of the diagonal of a matrix.
fn trace(matrix: &[[f64; 6]; 6]) -> f64 {
    let mut sum = 0.0;
    for row in 0..6 {
        sum += matrix[row][row];
    }
    sum
}

/// Solves a symmetric positive system in place, by Cholesky's method.
fn solve(matrix: &mut [[f64; 6]; 6], vector: &mut [f64; 6]) {
    for row in 0..6 {
        for column in 0..=row {
            let mut sum = matrix[row][column];
            for at in 0..column {
                sum -= matrix[row][at] * matrix[column][at];
            }
            if row == column {
                // Rounding may cancel a direction in which no joint moves.
                matrix[row][row] = f64::sqrt(if sum > 1e-300 { sum } else { 1e-300 });
            } else {
                matrix[row][column] = sum / matrix[column][column];
            }
        }
        let mut sum = vector[row];
        for at in 0..row {
            sum -= matrix[row][at] * vector[at];
        }
        vector[row] = sum / matrix[row][row];
    }
    for row in (0..6).rev() {
        let mut sum = vector[row];
        for at in row + 1..6 {
            sum -= matrix[at][row] * vector[at];
        }
        vector[row] = sum / matrix[row][row];
    }
}

/// Searches positions of joints in which a frame has a pose. It leaves
/// there the first ones that it found, or the nearest. Without a closed form, it begins with `positions`.
///
/// `motion` writes the pose of the frame (three rows of the homogeneous matrix) and its Jacobian (six
/// rows) for some positions. `work` has [`room`] numbers. Each call ends after
/// `iterations` computations of the motion from each of `closed`, from `positions`, and from each of `starts`, and one more if a joint
/// without an end is turned back.
pub fn pose(
    motion: impl Fn(&[f64], &mut [f64]),
    aim: &Aim<'_>,
    positions: &mut [f64],
    work: &mut [f64],
) -> Found {
    let joints = positions.len();
    let (mut now, work) = work.split_at_mut(12 + 6 * joints);
    let (mut next, work) = work.split_at_mut(12 + 6 * joints);
    let (first, work) = work.split_at_mut(joints);
    let (at, work) = work.split_at_mut(joints);
    let (trial, work) = work.split_at_mut(joints);
    let slope = &mut work[..joints];
    let length = aim.near / aim.turned;
    first.copy_from_slice(positions);
    let mut found = Found {
        reached: false,
        distance: f64::INFINITY,
        angle: f64::INFINITY,
        iterations: 0,
    };
    let mut least = f64::INFINITY;
    let each = if joints > 0 { joints } else { 1 };
    let closed = aim.closed.len() / each;
    let searches = closed + 1 + aim.starts.len() / each;
    for search in 0..searches {
        for joint in 0..joints {
            let start = match search {
                _ if search < closed => aim.closed[search * joints + joint],
                _ if search == closed => first[joint],
                _ => aim.starts[(search - closed - 1) * joints + joint],
            };
            at[joint] = within(start, aim.lower[joint], aim.upper[joint]);
        }
        if search == 0 {
            positions.copy_from_slice(at);
        }
        motion(at, now);
        found.iterations += 1;
        let (mut error, mut distance, mut angle) = way(aim.target, now, length);
        let mut cost = error.iter().map(|part| part * part).sum::<f64>();
        let mut damping = 0.1;
        for _ in 1..aim.iterations {
            if distance <= aim.near && angle <= aim.turned {
                break;
            }
            // A joint at a limit that would go on is left alone: its slope is not a number.
            let mut matrix = [[0.0; 6]; 6];
            for joint in 0..joints {
                let column = |row: usize| {
                    let weight = if row < 3 { 1.0 } else { length };
                    now[12 + row * joints + joint] * weight
                };
                let mut sum = 0.0;
                for row in 0..6 {
                    sum += column(row) * error[row];
                }
                let is_held = sum < 0.0 && at[joint] <= aim.lower[joint]
                    || sum > 0.0 && at[joint] >= aim.upper[joint];
                slope[joint] = if is_held { f64::NAN } else { sum };
                if is_held {
                    continue;
                }
                for row in 0..6 {
                    for other in 0..=row {
                        matrix[row][other] += column(row) * column(other);
                    }
                }
            }
            // In a direction in which no joint moves, more than rounding is left.
            let rest = 2.0 * f64::EPSILON * trace(&matrix);
            for row in 0..6 {
                matrix[row][row] += damping * cost + rest;
            }
            let mut pull = error;
            solve(&mut matrix, &mut pull);
            let mut longest = 0.0;
            for joint in 0..joints {
                trial[joint] = at[joint];
                if slope[joint] == slope[joint] {
                    let mut step = 0.0;
                    for row in 0..6 {
                        let weight = if row < 3 { 1.0 } else { length };
                        step += now[12 + row * joints + joint] * weight * pull[row];
                    }
                    trial[joint] = within(at[joint] + step, aim.lower[joint], aim.upper[joint]);
                    let way = f64::abs(trial[joint] - at[joint]);
                    longest = if way > longest { way } else { longest };
                }
            }
            if !(longest > 1e-12) {
                break;
            }
            motion(trial, next);
            found.iterations += 1;
            let (new_error, new_distance, new_angle) = way(aim.target, next, length);
            let new_cost = new_error.iter().map(|part| part * part).sum::<f64>();
            if new_cost < cost {
                at.copy_from_slice(trial);
                core::mem::swap(&mut now, &mut next);
                (error, distance, angle) = (new_error, new_distance, new_angle);
                let is_flat = cost - new_cost < 1e-4 * cost;
                cost = new_cost;
                damping *= 0.3;
                if is_flat {
                    break;
                }
            } else {
                damping *= 3.0;
            }
        }
        let reached = distance <= aim.near && angle <= aim.turned;
        if reached || cost < least {
            least = cost;
            found.reached = reached;
            (found.distance, found.angle) = (distance, angle);
            positions.copy_from_slice(at);
        }
        if reached {
            break;
        }
    }
    let mut is_turned = false;
    for joint in 0..joints {
        if aim.endless[joint] {
            let turns = (positions[joint] - first[joint]) / core::f64::consts::TAU;
            let turns = f64::floor(turns + 0.5);
            if turns != 0.0 && f64::abs(turns) < 1e9 {
                positions[joint] -= turns * core::f64::consts::TAU;
                is_turned = true;
            }
        }
    }
    if is_turned {
        // Positions have fewer digits far from 0.
        motion(positions, now);
        found.iterations += 1;
        (_, found.distance, found.angle) = way(aim.target, now, length);
        found.reached = found.distance <= aim.near && found.angle <= aim.turned;
    }
    found
}

/// Brings positions of a closed form within limits by whole turns, as near as possible to `first`, and leaves the nearest ones at the
/// beginning. Returns how many numbers remain: positions beyond a limit are dropped. `turns` are whole turns of the joints.
pub fn nearest(
    closed: &mut [f64],
    turns: &[f64],
    lower: &[f64],
    upper: &[f64],
    first: &[f64],
) -> usize {
    let joints = first.len();
    let (mut kept, mut at) = (0, 0);
    while at + joints <= closed.len() {
        let (mut far, mut is_within) = (0.0, true);
        for joint in 0..joints {
            let turn = turns[joint];
            let start = within(first[joint], lower[joint], upper[joint]);
            let mut place = closed[at + joint];
            place += turn * f64::floor((start - place) / turn + 0.5);
            if place > upper[joint] {
                place -= turn;
            } else if place < lower[joint] {
                place += turn;
            }
            // It is false for what is not a number, too.
            is_within = is_within && place >= lower[joint] && place <= upper[joint];
            closed[at + joint] = place;
            far += (place - first[joint]) * (place - first[joint]);
        }
        at += joints;
        if !is_within {
            continue;
        }
        // The nearest ones come first; of equal ones, the earlier.
        let mut place = kept;
        for joint in 0..joints {
            closed[kept + joint] = closed[at - joints + joint];
        }
        while place > 0 {
            let mut before = 0.0;
            for joint in 0..joints {
                let way = closed[place - joints + joint] - first[joint];
                before += way * way;
            }
            if before <= far {
                break;
            }
            for joint in 0..joints {
                closed.swap(place + joint, place - joints + joint);
            }
            place -= joints;
        }
        kept += joints;
    }
    kept
}

/// A velocity that a frame shall have.
pub struct Wish<'a> {
    /// In m/s, then in rad/s.
    pub velocity: &'a [f64; 6],
    /// The cost of velocities of joints that are not preferred. Greater than 0.
    pub damping: f64,
    /// The velocities of joints that are wanted where the frame leaves a choice.
    pub preferred: &'a [f64],
    /// The least velocities. An infinite one is not a limit.
    pub least: &'a [f64],
    /// The greatest velocities.
    pub most: &'a [f64],
}

/// The velocities `x` of joints within their limits with the least `|J x - v|^2 + d^2 |x - p|^2`, for the
/// Jacobian `J` in six rows, the velocity `v` of the frame, the damping `d` and the part `p` of the
/// preferred velocities that does not move the frame. A metre counts as much as a radian. Returns the
/// velocity `J x` of the frame.
///
/// Each call ends after so many steps as there are joints, eight times. `work` has [`room`] numbers.
pub fn velocity(
    jacobian: &[f64],
    wish: &Wish<'_>,
    velocities: &mut [f64],
    work: &mut [f64],
) -> [f64; 6] {
    let joints = velocities.len();
    let (wanted, work) = work.split_at_mut(joints);
    let (preferred, work) = work.split_at_mut(joints);
    // 0: free; -1 and 1: at the least and the greatest velocity.
    let (held, _) = work.split_at_mut(joints);
    let mut matrix = [[0.0; 6]; 6];
    let mut pull = [0.0; 6];
    for row in 0..6 {
        for joint in 0..joints {
            let part = jacobian[row * joints + joint];
            pull[row] += part * wish.preferred[joint];
            for other in 0..=row {
                matrix[row][other] += part * jacobian[other * joints + joint];
            }
        }
    }
    // In a direction in which no joint moves, more than rounding is left.
    let size = trace(&matrix);
    let rest = 2.0 * f64::EPSILON * size;
    let damping = wish.damping * wish.damping + rest;
    for row in 0..6 {
        matrix[row][row] += 1e-9 + rest;
    }
    solve(&mut matrix, &mut pull);
    for joint in 0..joints {
        let mut sum = wish.preferred[joint];
        for row in 0..6 {
            sum -= jacobian[row * joints + joint] * pull[row];
        }
        preferred[joint] = sum;
        velocities[joint] = within(sum, wish.least[joint], wish.most[joint]);
        held[joint] = 0.0;
    }
    for _ in 0..8 * joints {
        let mut matrix = [[0.0; 6]; 6];
        let mut pull = *wish.velocity;
        for joint in 0..joints {
            let is_free = held[joint] == 0.0;
            let known = if is_free {
                preferred[joint]
            } else {
                velocities[joint]
            };
            for row in 0..6 {
                let part = jacobian[row * joints + joint];
                pull[row] -= part * known;
                if is_free {
                    for other in 0..=row {
                        matrix[row][other] += part * jacobian[other * joints + joint];
                    }
                }
            }
        }
        for row in 0..6 {
            matrix[row][row] += damping;
        }
        solve(&mut matrix, &mut pull);
        // On the way to the best velocities of free joints, the first limit holds its joint.
        let (mut way, mut first) = (1.0, joints);
        for joint in 0..joints {
            if held[joint] != 0.0 {
                continue;
            }
            let mut sum = preferred[joint];
            for row in 0..6 {
                sum += jacobian[row * joints + joint] * pull[row];
            }
            wanted[joint] = sum;
            let step = sum - velocities[joint];
            let limit = if step > 0.0 {
                wish.most[joint]
            } else {
                wish.least[joint]
            };
            let is_beyond = if step > 0.0 { sum > limit } else { sum < limit };
            if is_beyond {
                let share = (limit - velocities[joint]) / step;
                if first == joints || share < way {
                    (way, first) = (share, joint);
                }
            }
        }
        for joint in 0..joints {
            if held[joint] == 0.0 {
                velocities[joint] += way * (wanted[joint] - velocities[joint]);
            }
        }
        if first < joints {
            let is_most = wanted[first] > wish.most[first];
            held[first] = if is_most { 1.0 } else { -1.0 };
            velocities[first] = if is_most {
                wish.most[first]
            } else {
                wish.least[first]
            };
            continue;
        }
        // A joint that is better off without its limit is free again.
        let mut error = *wish.velocity;
        let mut speed = 0.0;
        for row in 0..6 {
            speed += f64::abs(error[row]);
            for joint in 0..joints {
                let part = jacobian[row * joints + joint] * velocities[joint];
                error[row] -= part;
                speed += f64::abs(part);
            }
        }
        let rounding = f64::EPSILON * f64::sqrt(size) * speed;
        let (mut gain, mut last) = (1e-12 + rounding, joints);
        for joint in 0..joints {
            if held[joint] == 0.0 || wish.least[joint] == wish.most[joint] {
                continue;
            }
            let mut slope = damping * (preferred[joint] - velocities[joint]);
            for row in 0..6 {
                slope += jacobian[row * joints + joint] * error[row];
            }
            if -slope * held[joint] > gain {
                (gain, last) = (-slope * held[joint], joint);
            }
        }
        if last == joints {
            break;
        }
        held[last] = 0.0;
    }
    let mut reached = [0.0; 6];
    for joint in 0..joints {
        let (least, most) = (wish.least[joint], wish.most[joint]);
        velocities[joint] = within(velocities[joint], least, most);
        for row in 0..6 {
            reached[row] += jacobian[row * joints + joint] * velocities[joint];
        }
    }
    reached
}
