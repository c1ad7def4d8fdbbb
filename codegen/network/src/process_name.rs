//! Names of instances and slots outside of the description: processes, files, sockets and services.
//!
//! | of the instance `arm.left.motor` | |
//! |---|---|
//! | in messages, `status` and `logs`; its log | `arm.left.motor`, `arm.left.motor.log` |
//! | its own name (`--name`), its socket in the run directory, its node | `arm-left-motor`, `arm-left-motor.sock` |
//! | the address of its slot `Motor` | `NETWORK/arm/left/motor/Motor` |
//!
//! Names in a description consist of letters, digits and `_`, so two of them never become equal by
//! `.`, `-` or `/`. Within a block, no instance has the name of a group.

/// The name of an instance's process, which contains no `.`, for addresses and options.
pub fn process_name(path: &str) -> String {
    path.replace('.', "-")
}
