//! The processor that an executable is for, as its ELF header says (`e_machine`, elf(5)).

use rc_ddsl::model::Processor;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The running program, which is for the processor of this machine.
const OWN: &str = "/proc/self/exe";

/// The number of the processor of a program. `None` for a script and other files that are not ELF.
pub(crate) fn of(path: &Path) -> Option<u16> {
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

/// The number that a program has to have for this processor, or here. `None` if it may have none.
pub(crate) fn wanted(program: &Path, processor: Option<Processor>) -> Option<u16> {
    of(program)?;
    processor.map_or_else(|| of(Path::new(OWN)), |processor| Some(processor.elf()))
}

/// The name of a processor, as `uname -m` has it.
pub(crate) fn name(number: u16) -> &'static str {
    Processor::from_elf(number).map_or("another processor", Processor::machine)
}

/// The processor of this machine.
pub(crate) fn own() -> Option<Processor> {
    of(Path::new(OWN)).and_then(Processor::from_elf)
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
        assert_eq!(wanted(&path, None), of(Path::new(OWN)));
        assert_eq!(wanted(&path, Some(Processor::Arm64)), Some(183));
        assert_eq!(with(b"#!/bin/sh\nexec python3 worker.py\n"), None);
        assert_eq!((wanted(&path, None), with(b"\x7fELF")), (None, None));
    }
}
