//! A serial port from which a program reads without waiting.

use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, read};
use rustix::termios::{
    ControlModes, OptionalActions, QueueSelector, ioctl_tiocexcl, tcflush, tcgetattr, tcsetattr,
};
use std::os::fd::OwnedFd;
use std::path::Path;

/// The most bytes of one period: a port that never runs dry must not keep the component busy.
const MOST: usize = 1 << 16;

/// An open port.
#[derive(Debug)]
pub(crate) struct Port(OwnedFd);

impl Port {
    /// Opens a port for this process alone. What came before is forgotten.
    pub(crate) fn open(device: &Path, baud_rate: u32) -> Result<Self, String> {
        let failed = |error: Errno| format!("{}: {}", device.display(), reason(error));
        let flags = OFlags::RDONLY | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let port = open(device, flags, Mode::empty()).map_err(failed)?;
        let mut settings = tcgetattr(&port).map_err(failed)?;
        ioctl_tiocexcl(&port).map_err(failed)?;
        settings.make_raw();
        // 8 bits, no parity, one stop bit, and no line of a modem counts.
        let off = ControlModes::PARENB | ControlModes::CSTOPB | ControlModes::CRTSCTS;
        settings.control_modes.remove(off);
        settings
            .control_modes
            .insert(ControlModes::CLOCAL | ControlModes::CREAD);
        settings.set_speed(baud_rate).map_err(failed)?;
        tcsetattr(&port, OptionalActions::Now, &settings).map_err(failed)?;
        tcflush(&port, QueueSelector::IFlush).map_err(failed)?;
        Ok(Self(port))
    }

    /// Gives the bytes that wait to `take`. Fails if the device is gone.
    pub(crate) fn receive(&self, mut take: impl FnMut(&[u8])) -> Result<(), String> {
        let mut buffer = [0; 4096];
        let mut all = 0;
        while all < MOST {
            match read(&self.0, &mut buffer) {
                Ok(0) => return Err("the device is gone".to_owned()),
                Ok(count) => {
                    take(&buffer[..count]);
                    all += count;
                }
                Err(Errno::AGAIN) => return Ok(()),
                Err(Errno::INTR) => {}
                Err(error) => return Err(reason(error)),
            }
        }
        Ok(())
    }
}

fn reason(error: Errno) -> String {
    match error {
        Errno::NOENT | Errno::NXIO | Errno::NODEV => "no such device; is it plugged in?".to_owned(),
        Errno::ACCESS => {
            "permission denied; join its group, which is often `dialout`, and log in again"
                .to_owned()
        }
        Errno::BUSY => "another program has opened the port".to_owned(),
        Errno::NOTTY => "this is no serial port".to_owned(),
        Errno::IO => "the device is gone".to_owned(),
        other => other.to_string(),
    }
}
