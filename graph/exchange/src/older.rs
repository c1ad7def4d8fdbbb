//! Names of the oldest files of DSR.

/// The attributes of `RT` as the oldest files name them, and as all others do.
pub(crate) const OLDER: [(&str, &str); 2] = [
    ("translation", "rt_translation"),
    ("rotation_euler_xyz", "rt_rotation_euler_xyz"),
];
