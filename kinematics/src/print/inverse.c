/* The loops of inverse solvers: a damped Gauss-Newton method for positions (T. Sugihara, 2011), the
   least squares within limits for velocities. */
typedef struct {
    const double *target, *lower, *upper, *starts, *closed;
    const unsigned char *endless;
    double near, turned;
    int searches, iterations, closings;
} PREFIX__aim;

typedef struct {
    int reached, iterations;
    double distance, angle;
} PREFIX__found;

static inline double PREFIX__within(double value, double lower, double upper)
{
    if (value < lower)
        return lower;
    if (value > upper)
        return upper;
    if (value == value)
        return value;
    return lower > 0.0 || upper < 0.0 ? lower : 0.0;
}

/* The rotation vector of a matrix. Returns its angle. */
static inline double PREFIX__turning(double m[3][3], double *vector)
{
    const double w[3] = {0.5 * (m[2][1] - m[1][2]), 0.5 * (m[0][2] - m[2][0]), 0.5 * (m[1][0] - m[0][1])};
    const double sine = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    const double cosine = 0.5 * (m[0][0] + m[1][1] + m[2][2] - 1.0);
    const double angle = atan2(sine, cosine);
    double axis[3], square = 0.0, along = 0.0, factor;
    int most = 0;
    if (cosine > -0.9) {
        factor = sine > 0.0 ? angle / sine : 1.0;
        for (int at = 0; at < 3; at++)
            vector[at] = w[at] * factor;
        return angle;
    }
    /* Near half a turn, the sine says little of the axis: the greatest column of (1 - cos) a aT does. */
    for (int at = 1; at < 3; at++)
        if (m[at][at] > m[most][most])
            most = at;
    for (int at = 0; at < 3; at++) {
        axis[at] = 0.5 * (m[at][most] + m[most][at]);
        if (at == most)
            axis[at] -= cosine;
        square += axis[at] * axis[at];
        along += axis[at] * w[at];
    }
    factor = (along < 0.0 ? -angle : angle) / sqrt(square);
    for (int at = 0; at < 3; at++)
        vector[at] = axis[at] * factor;
    return angle;
}

/* The way from a pose to its target: metres, then radians times `length`. */
static inline void PREFIX__way(const double *target, const double *pose, double length, double *way, double *distance, double *angle)
{
    double turn[3][3] = {{0.0}};
    for (int row = 0; row < 3; row++) {
        way[row] = target[4 * row + 3] - pose[4 * row + 3];
        for (int column = 0; column < 3; column++)
            for (int at = 0; at < 3; at++)
                turn[row][column] += target[4 * row + at] * pose[4 * column + at];
    }
    *distance = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    *angle = PREFIX__turning(turn, way + 3);
    for (int at = 3; at < 6; at++)
        way[at] *= length;
}

static inline double PREFIX__square(const double *way)
{
    double sum = 0.0;
    for (int row = 0; row < 6; row++)
        sum += way[row] * way[row];
    return sum;
}

static inline double PREFIX__trace(double matrix[6][6])
{
    double sum = 0.0;
    for (int row = 0; row < 6; row++)
        sum += matrix[row][row];
    return sum;
}

/* Solves a symmetric positive system in place, by Cholesky's method. */
static inline void PREFIX__solve(double matrix[6][6], double *vector)
{
    for (int row = 0; row < 6; row++) {
        double sum;
        for (int column = 0; column <= row; column++) {
            sum = matrix[row][column];
            for (int at = 0; at < column; at++)
                sum -= matrix[row][at] * matrix[column][at];
            if (row == column)
                matrix[row][row] = sqrt(sum > 1e-300 ? sum : 1e-300);
            else
                matrix[row][column] = sum / matrix[column][column];
        }
        sum = vector[row];
        for (int at = 0; at < row; at++)
            sum -= matrix[row][at] * vector[at];
        vector[row] = sum / matrix[row][row];
    }
    for (int row = 5; row >= 0; row--) {
        double sum = vector[row];
        for (int at = row + 1; at < 6; at++)
            sum -= matrix[at][row] * vector[at];
        vector[row] = sum / matrix[row][row];
    }
}

/* Searches positions in which a frame has a pose. `motion` writes three rows of the pose and six of the
   Jacobian. `work` has 24 + 16 * joints numbers. */
static inline PREFIX__found PREFIX__search(void (*motion)(const double *, double *), const PREFIX__aim *aim, int joints, double *positions, double *work)
{
    double *now = work, *next = now + 12 + 6 * joints, *first = next + 12 + 6 * joints;
    double *at = first + joints, *trial = at + joints, *slope = trial + joints;
    const double length = aim->near / aim->turned;
    double least = INFINITY;
    int is_turned = 0;
    PREFIX__found found = {0, 0, INFINITY, INFINITY};
    for (int joint = 0; joint < joints; joint++)
        first[joint] = positions[joint];
    for (int search = -aim->closings; search < aim->searches; search++) {
        double error[6], distance, angle, cost, damping = 0.1;
        int reached;
        for (int joint = 0; joint < joints; joint++) {
            const double start = search < 0    ? aim->closed[(search + aim->closings) * joints + joint]
                                 : search == 0 ? first[joint]
                                               : aim->starts[(search - 1) * joints + joint];
            at[joint] = PREFIX__within(start, aim->lower[joint], aim->upper[joint]);
            if (search == -aim->closings)
                positions[joint] = at[joint];
        }
        motion(at, now);
        found.iterations++;
        PREFIX__way(aim->target, now, length, error, &distance, &angle);
        cost = PREFIX__square(error);
        for (int iteration = 1; iteration < aim->iterations; iteration++) {
            double matrix[6][6] = {{0.0}}, pull[6], longest = 0.0, new_error[6], new_distance, new_angle, new_cost, rest;
            if (distance <= aim->near && angle <= aim->turned)
                break;
            /* A joint at a limit that would go on is left alone: its slope is not a number. */
            for (int joint = 0; joint < joints; joint++) {
                double column[6], sum = 0.0;
                int is_held;
                for (int row = 0; row < 6; row++) {
                    column[row] = now[12 + row * joints + joint] * (row < 3 ? 1.0 : length);
                    sum += column[row] * error[row];
                }
                is_held = (sum < 0.0 && at[joint] <= aim->lower[joint]) || (sum > 0.0 && at[joint] >= aim->upper[joint]);
                slope[joint] = is_held ? NAN : sum;
                if (is_held)
                    continue;
                for (int row = 0; row < 6; row++)
                    for (int other = 0; other <= row; other++)
                        matrix[row][other] += column[row] * column[other];
            }
            /* In a direction in which no joint moves, more than rounding is left. */
            rest = 2.0 * DBL_EPSILON * PREFIX__trace(matrix);
            for (int row = 0; row < 6; row++) {
                matrix[row][row] += damping * cost + rest;
                pull[row] = error[row];
            }
            PREFIX__solve(matrix, pull);
            for (int joint = 0; joint < joints; joint++) {
                trial[joint] = at[joint];
                if (slope[joint] == slope[joint]) {
                    double step = 0.0, way;
                    for (int row = 0; row < 6; row++)
                        step += now[12 + row * joints + joint] * (row < 3 ? 1.0 : length) * pull[row];
                    trial[joint] = PREFIX__within(at[joint] + step, aim->lower[joint], aim->upper[joint]);
                    way = fabs(trial[joint] - at[joint]);
                    longest = way > longest ? way : longest;
                }
            }
            if (!(longest > 1e-12))
                break;
            motion(trial, next);
            found.iterations++;
            PREFIX__way(aim->target, next, length, new_error, &new_distance, &new_angle);
            new_cost = PREFIX__square(new_error);
            if (new_cost < cost) {
                double *other = now;
                const int is_flat = cost - new_cost < 1e-4 * cost;
                now = next;
                next = other;
                for (int joint = 0; joint < joints; joint++)
                    at[joint] = trial[joint];
                for (int row = 0; row < 6; row++)
                    error[row] = new_error[row];
                distance = new_distance;
                angle = new_angle;
                cost = new_cost;
                damping *= 0.3;
                if (is_flat)
                    break;
            } else {
                damping *= 3.0;
            }
        }
        reached = distance <= aim->near && angle <= aim->turned;
        if (reached || cost < least) {
            least = cost;
            found.reached = reached;
            found.distance = distance;
            found.angle = angle;
            for (int joint = 0; joint < joints; joint++)
                positions[joint] = at[joint];
        }
        if (reached)
            break;
    }
    for (int joint = 0; joint < joints; joint++) {
        if (aim->endless[joint]) {
            const double turns = floor((positions[joint] - first[joint]) / 6.283185307179586 + 0.5);
            if (turns != 0.0 && fabs(turns) < 1e9) {
                positions[joint] -= turns * 6.283185307179586;
                is_turned = 1;
            }
        }
    }
    if (is_turned) {
        /* Positions have fewer digits far from 0. */
        double error[6];
        motion(positions, now);
        found.iterations++;
        PREFIX__way(aim->target, now, length, error, &found.distance, &found.angle);
        found.reached = found.distance <= aim->near && found.angle <= aim->turned;
    }
    return found;
}

/* Brings `count` numbers of a closed form, positions after positions, within limits by whole turns, as near as possible to
   `first`. Returns how many positions remain, the nearest ones first. */
static inline int PREFIX__nearest(double *closed, int count, const double *turns, const double *lower, const double *upper, int joints, const double *first)
{
    int kept = 0;
    for (int at = 0; at + joints <= count; at += joints) {
        double far = 0.0;
        int is_within = 1;
        for (int joint = 0; joint < joints; joint++) {
            const double turn = turns[joint], start = PREFIX__within(first[joint], lower[joint], upper[joint]);
            double place = closed[at + joint];
            place += turn * floor((start - place) / turn + 0.5);
            if (place > upper[joint])
                place -= turn;
            else if (place < lower[joint])
                place += turn;
            is_within = is_within && place >= lower[joint] && place <= upper[joint];
            closed[at + joint] = place;
            far += (place - first[joint]) * (place - first[joint]);
        }
        if (!is_within)
            continue;
        for (int joint = 0; joint < joints; joint++)
            closed[kept * joints + joint] = closed[at + joint];
        for (int place = kept; place > 0; place--) {
            double *own = closed + place * joints, *other = own - joints, before = 0.0;
            for (int joint = 0; joint < joints; joint++)
                before += (other[joint] - first[joint]) * (other[joint] - first[joint]);
            if (before <= far)
                break;
            for (int joint = 0; joint < joints; joint++) {
                const double swapped = own[joint];
                own[joint] = other[joint];
                other[joint] = swapped;
            }
        }
        kept++;
    }
    return kept;
}

/* The velocities x of joints within their limits with the least |J x - v|^2 + d^2 |x - p|^2, for the part p of
   the preferred velocities that does not move the frame. `held` is 0 for a joint that is free, -1 and 1 for
   one at its least and greatest velocity. */
static inline void PREFIX__rates(const double *jacobian, const double *wish, double damped, double *preferred, const double *least, const double *most, int joints, double *velocities, double *achieved, double *wanted, double *held)
{
    double square[6][6] = {{0.0}}, moved[6] = {0.0}, size, rest, damping;
    for (int row = 0; row < 6; row++) {
        for (int joint = 0; joint < joints; joint++) {
            const double part = jacobian[row * joints + joint];
            moved[row] += part * preferred[joint];
            for (int other = 0; other <= row; other++)
                square[row][other] += part * jacobian[other * joints + joint];
        }
    }
    /* In a direction in which no joint moves, more than rounding is left. */
    size = PREFIX__trace(square);
    rest = 2.0 * DBL_EPSILON * size;
    damping = damped * damped + rest;
    for (int row = 0; row < 6; row++)
        square[row][row] += 1e-9 + rest;
    PREFIX__solve(square, moved);
    for (int joint = 0; joint < joints; joint++) {
        for (int row = 0; row < 6; row++)
            preferred[joint] -= jacobian[row * joints + joint] * moved[row];
        velocities[joint] = PREFIX__within(preferred[joint], least[joint], most[joint]);
        held[joint] = 0.0;
    }
    for (int step = 0; step < 8 * joints; step++) {
        double matrix[6][6] = {{0.0}}, pull[6], error[6], way = 1.0, speed = 0.0, gain;
        int first = joints, last = joints;
        for (int row = 0; row < 6; row++)
            pull[row] = wish[row];
        for (int joint = 0; joint < joints; joint++) {
            const int is_free = held[joint] == 0.0;
            const double known = is_free ? preferred[joint] : velocities[joint];
            for (int row = 0; row < 6; row++) {
                const double part = jacobian[row * joints + joint];
                pull[row] -= part * known;
                if (is_free)
                    for (int other = 0; other <= row; other++)
                        matrix[row][other] += part * jacobian[other * joints + joint];
            }
        }
        for (int row = 0; row < 6; row++)
            matrix[row][row] += damping;
        PREFIX__solve(matrix, pull);
        /* On the way to the best velocities of free joints, the first limit holds its joint. */
        for (int joint = 0; joint < joints; joint++) {
            double sum, change, limit;
            if (held[joint] != 0.0)
                continue;
            sum = preferred[joint];
            for (int row = 0; row < 6; row++)
                sum += jacobian[row * joints + joint] * pull[row];
            wanted[joint] = sum;
            change = sum - velocities[joint];
            limit = change > 0.0 ? most[joint] : least[joint];
            if (change > 0.0 ? sum > limit : sum < limit) {
                const double share = (limit - velocities[joint]) / change;
                if (first == joints || share < way) {
                    way = share;
                    first = joint;
                }
            }
        }
        for (int joint = 0; joint < joints; joint++)
            if (held[joint] == 0.0)
                velocities[joint] += way * (wanted[joint] - velocities[joint]);
        if (first < joints) {
            const int is_most = wanted[first] > most[first];
            held[first] = is_most ? 1.0 : -1.0;
            velocities[first] = is_most ? most[first] : least[first];
            continue;
        }
        /* A joint that is better off without its limit is free again. */
        for (int row = 0; row < 6; row++) {
            error[row] = wish[row];
            speed += fabs(error[row]);
            for (int joint = 0; joint < joints; joint++) {
                const double part = jacobian[row * joints + joint] * velocities[joint];
                error[row] -= part;
                speed += fabs(part);
            }
        }
        gain = 1e-12 + DBL_EPSILON * sqrt(size) * speed;
        for (int joint = 0; joint < joints; joint++) {
            double slope;
            if (held[joint] == 0.0 || least[joint] == most[joint])
                continue;
            slope = damping * (preferred[joint] - velocities[joint]);
            for (int row = 0; row < 6; row++)
                slope += jacobian[row * joints + joint] * error[row];
            if (-slope * held[joint] > gain) {
                gain = -slope * held[joint];
                last = joint;
            }
        }
        if (last == joints)
            break;
        held[last] = 0.0;
    }
    for (int row = 0; row < 6; row++)
        achieved[row] = 0.0;
    for (int joint = 0; joint < joints; joint++) {
        velocities[joint] = PREFIX__within(velocities[joint], least[joint], most[joint]);
        for (int row = 0; row < 6; row++)
            achieved[row] += jacobian[row * joints + joint] * velocities[joint];
    }
}
