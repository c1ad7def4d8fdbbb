//! IDSL as ROS 2 has it: what packages, messages and services are called, of what fields they are, and which types of
//! others structures are. `middleware/ros2/MAPPING.md` tells it to users.

pub mod names;
mod words;
