//! The processor that an executable is for, as its ELF header says (`e_machine`, elf(5)).

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The running program, which is for the processor of this machine.
const OWN: &str = "/proc/self/exe";

/// The number of the processor of a program. `None` for a script and other files that are not ELF.
pub(super) fn of(path: &Path) -> Option<u16> {
    let mut header = [0; 20];
    File::open(path).ok()?.read_exact(&mut header).ok()?;
    let (magic, rest) = header.split_at(4);
    let bytes = [header[18], header[19]];
    // EI_DATA: the order of bytes.
    (magic == b"\x7fELF").then(|| match rest[1] {
        2 => u16::from_be_bytes(bytes),
        _ => u16::from_le_bytes(bytes),
    })
}

/// The number that a program has to have here. `None` if it may have none.
pub(super) fn own(program: &Path) -> Option<u16> {
    of(program)?;
    of(Path::new(OWN))
}

/// The name of a processor, as `uname -m` has it.
pub(super) fn name(number: u16) -> &'static str {
    match number {
        3 => "i686",
        40 => "armv7l",
        62 => "x86_64",
        183 => "aarch64",
        243 => "riscv64",
        _ => "another processor",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_of_a_program_is_read_from_its_header() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("program");
        let with = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("a file");
            of(&path)
        };
        let mut header = [0; 64];
        header[..6].copy_from_slice(b"\x7fELF\x02\x01");
        header[18] = 183;
        assert_eq!(with(&header).map(name), Some("aarch64"));
        header[5] = 2;
        header[18..20].copy_from_slice(&[0, 62]);
        assert_eq!(with(&header).map(name), Some("x86_64"));
        assert_eq!(own(&path), of(Path::new(OWN)));
        assert_eq!(with(b"#!/bin/sh\nexec python3 worker.py\n"), None);
        assert_eq!((own(&path), with(b"\x7fELF")), (None, None));
    }
}
