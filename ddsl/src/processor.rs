//! Architectures of processors, under the names that each program has for them.

/// The architecture of a processor, with the word that Debian has for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Processor {
    /// 64-bit x86.
    Amd64,
    /// 64-bit ARM.
    Arm64,
    /// 32-bit ARM with a floating-point unit.
    Armhf,
    /// 64-bit RISC-V.
    Riscv64,
}

impl Processor {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 4] = [Self::Amd64, Self::Arm64, Self::Armhf, Self::Riscv64];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Amd64 => "amd64",
            Self::Arm64 => "arm64",
            Self::Armhf => "armhf",
            Self::Riscv64 => "riscv64",
        }
    }

    /// The processor that a word names exactly.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.word() == word)
    }

    /// All words, in the order in which messages list them.
    pub fn words() -> impl Iterator<Item = &'static str> {
        Self::ALL.into_iter().map(Self::word)
    }

    /// The name that `uname -m` prints.
    pub fn machine(self) -> &'static str {
        match self {
            Self::Amd64 => "x86_64",
            Self::Arm64 => "aarch64",
            Self::Armhf => "armv7l",
            Self::Riscv64 => "riscv64",
        }
    }

    /// The processor of a machine where `uname -m` prints this.
    pub fn from_machine(machine: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.machine() == machine)
    }

    /// The number in an ELF header (`e_machine`, elf(5)).
    pub fn elf(self) -> u16 {
        match self {
            Self::Amd64 => 62,
            Self::Arm64 => 183,
            Self::Armhf => 40,
            Self::Riscv64 => 243,
        }
    }

    /// The processor with this number in an ELF header.
    pub fn from_elf(number: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.elf() == number)
    }

    /// The platform of rustc: Linux with the GNU C library.
    pub fn platform(self) -> &'static str {
        match self {
            Self::Amd64 => "x86_64-unknown-linux-gnu",
            Self::Arm64 => "aarch64-unknown-linux-gnu",
            Self::Armhf => "armv7-unknown-linux-gnueabihf",
            Self::Riscv64 => "riscv64gc-unknown-linux-gnu",
        }
    }

    /// The name of the GNU toolchain, with which its programs begin: `NAME-gcc`.
    pub fn toolchain(self) -> &'static str {
        match self {
            Self::Amd64 => "x86_64-linux-gnu",
            Self::Arm64 => "aarch64-linux-gnu",
            Self::Armhf => "arm-linux-gnueabihf",
            Self::Riscv64 => "riscv64-linux-gnu",
        }
    }
}

impl std::fmt::Display for Processor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}
