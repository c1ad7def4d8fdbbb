// Printed functions write into objects of Eigen and structures of C, which Eigen reads.

#include <Eigen/Geometry>
#include <cstdio>
#include <cstdlib>
#include <random>

extern "C" {
int pose_to_isometry(const double *, double *);
int isometry_to_pose(const double *, double *);
int coefficients_to_rotation(const double *, double *);
int rotation_to_coefficients(const double *, double *);
int coefficients_to_turn(const double *, double *);
int turn_to_coefficients(const double *, double *);
int coefficients_to_yaw_pitch_roll(const double *, double *);
int pose_to_optical(const double *, double *);
int optical_to_isometry(const double *, double *);
}

// A pose as C99 has it, and in other units and axes.
struct Pose { double place[3]; double turn[4]; };
struct Optical { double place[3]; double matrix[9]; };

static int count = 0;

template <class A, class B> void near(const char *what, const A &found, const B &wanted)
{
    count++;
    if (!((found - wanted).array().abs() <= 1e-12 * (1 + wanted.array().abs())).all()) {
        std::printf("%s differs by %g\n", what, (found - wanted).array().abs().maxCoeff());
        std::exit(1);
    }
}

static void done(int refused)
{
    if (refused) {
        std::printf("refused\n");
        std::exit(1);
    }
}

int main()
{
    std::mt19937_64 random(38);
    std::normal_distribution<double> normal;
    const auto next = [&] { return normal(random); };
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    for (int round = 0; round < 1000; round++) {
        const Eigen::Quaterniond turn = Eigen::Quaterniond(next(), next(), next(), next()).normalized();
        const Eigen::Vector3d place = 5 * Eigen::Vector3d(next(), next(), next());
        const Eigen::Isometry3d wanted = Eigen::Translation3d(place) * turn;

        Pose pose = {{place.x(), place.y(), place.z()}, {turn.x(), turn.y(), turn.z(), turn.w()}};
        Eigen::Isometry3d isometry;
        done(pose_to_isometry(pose.place, isometry.data()));
        near("the isometry", isometry.matrix(), wanted.matrix());
        Pose back;
        done(isometry_to_pose(wanted.data(), back.place));
        near("its place", Eigen::Map<Eigen::Vector3d>(back.place), place);
        const Eigen::Map<Eigen::Quaterniond> found(back.turn);
        near("its turn", found.toRotationMatrix(), turn.toRotationMatrix());

        RowMajor rotation;
        done(coefficients_to_rotation(turn.coeffs().data(), rotation.data()));
        near("the matrix", rotation, turn.toRotationMatrix());
        const RowMajor rows = turn.toRotationMatrix();
        Eigen::Quaterniond coefficients;
        done(rotation_to_coefficients(rows.data(), coefficients.coeffs().data()));
        near("the quaternion", coefficients.toRotationMatrix(), turn.toRotationMatrix());

        double axis[4];
        done(coefficients_to_turn(turn.coeffs().data(), axis));
        const Eigen::AngleAxisd about(axis[3], Eigen::Vector3d(axis[0], axis[1], axis[2]));
        near("axis and angle", about.toRotationMatrix(), turn.toRotationMatrix());
        const Eigen::AngleAxisd own(turn);
        const double given[4] = {own.axis().x(), own.axis().y(), own.axis().z(), own.angle()};
        done(turn_to_coefficients(given, coefficients.coeffs().data()));
        near("the turn back", coefficients.toRotationMatrix(), turn.toRotationMatrix());

        double angles[3];
        done(coefficients_to_yaw_pitch_roll(turn.coeffs().data(), angles));
        const Eigen::Quaterniond turned = Eigen::AngleAxisd(angles[0], Eigen::Vector3d::UnitZ())
            * Eigen::AngleAxisd(angles[1], Eigen::Vector3d::UnitY())
            * Eigen::AngleAxisd(angles[2], Eigen::Vector3d::UnitX());
        near("yaw, pitch, roll", turned.toRotationMatrix(), turn.toRotationMatrix());

        // Right, down and ahead of a camera, in millimetres.
        Eigen::Matrix3d axes;
        axes << 0, -1, 0, 0, 0, -1, 1, 0, 0;
        Optical optical;
        done(pose_to_optical(pose.place, optical.place));
        near("the place in mm", Eigen::Map<Eigen::Vector3d>(optical.place), Eigen::Vector3d(1000 * (axes * place)));
        near("the turn of the camera", Eigen::Map<RowMajor>(optical.matrix), RowMajor(axes * turn.toRotationMatrix() * axes.transpose()));
        done(optical_to_isometry(optical.place, isometry.data()));
        near("the isometry of the camera", isometry.matrix(), wanted.matrix());
    }
    std::printf("%d", count);
    return 0;
}
