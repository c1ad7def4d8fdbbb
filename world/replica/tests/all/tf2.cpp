// What tf2's own BufferCore answers. Reads lines: "set PARENT CHILD TIME X Y Z QX QY QZ QW" and "get TO FROM TIME", whose
// times are nanoseconds. Prints twelve numbers for each "get", rotation by rows and translation, or why there is none.
#include <tf2/buffer_core.h>
#include <tf2/exceptions.h>
#include <tf2/LinearMath/Matrix3x3.h>
#include <tf2/LinearMath/Quaternion.h>
#include <geometry_msgs/TransformStamped.h>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <string>

int main()
{
    tf2::BufferCore buffer(ros::Duration(3600));
    std::string what;
    while (std::cin >> what)
    {
        std::string one, other;
        uint64_t time;
        std::cin >> one >> other >> time;
        ros::Time stamp;
        stamp.fromNSec(time);
        if (what == "set")
        {
            geometry_msgs::TransformStamped placed;
            placed.header.frame_id = one;
            placed.header.stamp = stamp;
            placed.child_frame_id = other;
            auto &t = placed.transform.translation;
            auto &q = placed.transform.rotation;
            std::cin >> t.x >> t.y >> t.z >> q.x >> q.y >> q.z >> q.w;
            buffer.setTransform(placed, "test");
            continue;
        }
        try
        {
            const auto found = buffer.lookupTransform(one, other, stamp).transform;
            const tf2::Matrix3x3 turn(tf2::Quaternion(found.rotation.x, found.rotation.y, found.rotation.z, found.rotation.w));
            for (int row = 0; row < 3; row++)
                for (int column = 0; column < 3; column++)
                    std::printf("%.17g ", turn[row][column]);
            std::printf("%.17g %.17g %.17g\n", found.translation.x, found.translation.y, found.translation.z);
        }
        catch (const tf2::TransformException &error)
        {
            std::printf("none\n");
        }
    }
}
