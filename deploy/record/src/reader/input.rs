//! The bytes of one file, also of one that is compressed as a whole.

use lz4_flex::frame::FrameDecoder;
use rc_diagnostics::foreign::clean;
use rc_mcap::read::{END, LONGEST, Summary, summary, summary_start};
use ruzstd::decoding::StreamingDecoder;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The longest summary that is read, in bytes.
const LONGEST_SUMMARY: u64 = 64 << 20;
/// Size of a read, in bytes.
const BUFFER: usize = 1 << 16;

type Zstd = StreamingDecoder<BufReader<File>, ruzstd::decoding::FrameDecoder>;

/// A file, from its beginning on.
pub(super) enum Input {
    /// Its records as they are, and their length.
    Plain(BufReader<File>, u64),
    /// Compressed with zstd; `None` at its end.
    Zstd(Option<Box<Zstd>>),
}

impl Input {
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = rc_files::open_regular(path)?;
        let length = file.metadata()?.len();
        let file = BufReader::with_capacity(BUFFER, file);
        if path
            .extension()
            .is_some_and(|end| end == "zstd" || end == "zst")
        {
            return Ok(Self::Zstd(Some(Box::new(frame(file)?))));
        }
        Ok(Self::Plain(file, length))
    }

    /// The length of the file, if it is known.
    pub(super) fn length(&self) -> Option<u64> {
        match self {
            Self::Plain(_, length) => Some(*length),
            Self::Zstd(_) => None,
        }
    }

    /// Goes to a place. Only a file that is not compressed has places.
    pub(super) fn seek(&mut self, to: u64) -> io::Result<()> {
        match self {
            Self::Plain(file, _) => file.seek(SeekFrom::Start(to)).map(drop),
            Self::Zstd(_) => Err(io::Error::other("it is compressed as a whole")),
        }
    }

    /// The bytes of the summary at the end, if there is one. Goes back to the beginning.
    pub(super) fn summary(&mut self) -> Option<(Vec<u8>, Summary)> {
        let Self::Plain(file, length) = self else {
            return None;
        };
        let end = length.checked_sub(END as u64)?;
        let mut read = || {
            let mut footer = [0; END];
            file.seek(SeekFrom::Start(end)).ok()?;
            file.read_exact(&mut footer).ok()?;
            let start = summary_start(&footer).filter(|start| *start < end)?;
            let length = Some(end - start).filter(|length| *length <= LONGEST_SUMMARY)?;
            let mut bytes = Vec::new();
            file.seek(SeekFrom::Start(start)).ok()?;
            file.by_ref().take(length).read_to_end(&mut bytes).ok()?;
            let summary = summary(&bytes).ok()?;
            Some((bytes, summary))
        };
        let found = read();
        self.seek(0).ok()?;
        found
    }
}

impl Read for Input {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let decoder = match self {
            Self::Plain(file, _) => return file.read(out),
            Self::Zstd(decoder) => decoder,
        };
        while let Some(mut present) = decoder.take() {
            let count = present.read(out)?;
            if count > 0 || out.is_empty() {
                *decoder = Some(present);
                return Ok(count);
            }
            // Another frame may follow.
            let mut file = present.into_inner();
            if !file.fill_buf()?.is_empty() {
                *decoder = Some(Box::new(frame(file)?));
            }
        }
        Ok(0)
    }
}

fn frame(file: BufReader<File>) -> io::Result<Zstd> {
    StreamingDecoder::new(file)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, damaged_zstd(&error)))
}

pub(super) fn damaged_zstd(error: &dyn Display) -> String {
    format!("its compression with zstd is damaged: {error}")
}

/// The records of a chunk, which has `size` bytes before compression.
pub(super) fn decompress(compression: &str, records: &[u8], size: u64) -> Result<Vec<u8>, String> {
    if size > LONGEST {
        return Err(format!("a chunk has {size} bytes"));
    }
    let mut chunk = Vec::new();
    // One byte beyond the limit shows that there are more.
    let read = match compression {
        "lz4" => FrameDecoder::new(records)
            .take(size + 1)
            .read_to_end(&mut chunk),
        "zstd" => StreamingDecoder::new(records)
            .map_err(|e| format!("a chunk is damaged: {e}"))?
            .take(size + 1)
            .read_to_end(&mut chunk),
        other => {
            return Err(format!(
                "its chunks are compressed with `{}`, which is not known",
                clean(other)
            ));
        }
    };
    read.map_err(|e| format!("a chunk is damaged: {e}"))?;
    check_length(chunk.len(), size)?;
    Ok(chunk)
}

/// Compares the length of a chunk with the one that it states.
pub(super) fn check_length(length: usize, size: u64) -> Result<(), String> {
    match (length as u64).cmp(&size) {
        std::cmp::Ordering::Equal => Ok(()),
        std::cmp::Ordering::Less => Err("a chunk is shorter than it says".to_owned()),
        std::cmp::Ordering::Greater => Err("a chunk is longer than it says".to_owned()),
    }
}
