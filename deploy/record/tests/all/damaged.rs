//! Recordings with damage: what follows it is read, and the damage is counted.

use rc_mcap::op;
use rc_record::bag::{Selection, cut};
use rc_record::{Faults, Limits, Reader, Record, Stamp, Writer};
use std::collections::BTreeMap;
use std::path::Path;

/// How many chunks a file has, and how many messages a chunk has.
const CHUNKS: u64 = 10;
const MESSAGES: u64 = 100;

/// A file of chunks. The first one holds the channel.
fn write(path: &Path) -> Vec<u8> {
    write_chunks(path, CHUNKS, MESSAGES)
}

/// A file of so many chunks, each with so many messages.
fn write_chunks(path: &Path, chunks: u64, messages: u64) -> Vec<u8> {
    let mut writer = Writer::create(path, Limits::default()).expect("to create");
    let channel = writer.channel("/a", "json", None, BTreeMap::new());
    for chunk in 0..chunks {
        for at in 0..messages {
            let time = chunk * messages + at;
            let stamp = Stamp {
                log_time: time,
                publish_time: time,
                sequence: 0,
            };
            writer.write(channel, stamp, &[7; 50]).expect("to write");
        }
        // It ends the chunk.
        let table = BTreeMap::from([("chunk".to_owned(), chunk.to_string())]);
        writer.metadata("m", &table).expect("to write");
    }
    writer.finish().expect("to finish");
    std::fs::read(path).expect("to read")
}

/// Where the records of this kind begin, before the summary.
fn places(bytes: &[u8], code: u8) -> Vec<usize> {
    let mut at = rc_mcap::MAGIC.len();
    let mut found = Vec::new();
    while at + 9 < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes"));
        if bytes[at] == code {
            found.push(at);
        }
        if bytes[at] == op::DATA_END {
            break;
        }
        at += 9 + length as usize;
    }
    found
}

/// The times of the messages, and what is wrong.
fn read(path: &Path) -> (Vec<u64>, Faults) {
    let mut reader = Reader::open(path).expect("a recording");
    let mut times = Vec::new();
    while let Some(record) = reader.next() {
        if let Record::Message(message) = record {
            times.push(message.log_time);
        }
    }
    (times, reader.faults().clone())
}

/// All times but those of these chunks.
fn without(missing: &[u64]) -> Vec<u64> {
    let all = 0..CHUNKS * MESSAGES;
    all.filter(|time| !missing.contains(&(time / MESSAGES)))
        .collect()
}

#[test]
fn a_damaged_chunk_is_skipped_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let whole = write(&path);
    let begins = places(&whole, op::CHUNK);
    assert_eq!(begins.len() as u64, CHUNKS);
    // Also the first one, whose channel is in the summary, too.
    let mut bytes = whole.clone();
    for chunk in [0, 4] {
        for at in 80..83 {
            bytes[begins[chunk] + at] ^= 0x55;
        }
    }
    std::fs::write(&path, &bytes).expect("to write");
    let (times, faults) = read(&path);
    assert_eq!(times, without(&[0, 4]));
    assert_eq!((faults.damaged, &faults.cut), (2, &None), "{faults}");
    let part = folder.path().join("part.mcap");
    let (count, of_cut) = cut(&path, Selection::default(), &part).expect("a part");
    assert_eq!((count, &of_cut), (800, &faults));

    // A length that reaches into the next chunk, beyond the end of the file, and into the chunk.
    for length in [begins[4] as u64, 1 << 40, u64::MAX, 5] {
        let mut bytes = whole.clone();
        bytes[begins[3] + 1..begins[3] + 9].copy_from_slice(&length.to_le_bytes());
        std::fs::write(&path, &bytes).expect("to write");
        let (times, faults) = read(&path);
        assert_eq!(times, without(&[3]), "{length}");
        assert!(faults.damaged >= 1 && faults.cut.is_none(), "{faults}");
    }
    // Something else in the place of a chunk: the end of the data, a kind that nobody knows, and one
    // that is read only in the summary.
    for code in [op::DATA_END, 0x77, 0xff, op::STATISTICS] {
        let mut bytes = whole.clone();
        bytes[begins[3]] = code;
        std::fs::write(&path, &bytes).expect("to write");
        let (times, faults) = read(&path);
        assert_eq!(times, without(&[3]), "{code}");
        assert_eq!(
            (faults.damaged, &faults.cut),
            (1, &None),
            "{code}: {faults}"
        );
    }
}

#[test]
fn reading_goes_on_where_a_known_record_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let whole = write(&path);
    let begin = places(&whole, op::CHUNK)[3];
    let mut tables = places(&whole, op::METADATA).into_iter();
    let table = tables.find(|table| *table > begin).expect("its table");
    let mut too_long = whole;
    too_long[begin + 1..begin + 9].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    // The table behind the chunk has another kind, or another length.
    let mut of_other_kind = too_long.clone();
    of_other_kind[table] = 0x77;
    let mut of_other_length = too_long.clone();
    of_other_length[table + 1] ^= 1;
    for bytes in [too_long, of_other_kind, of_other_length] {
        std::fs::write(&path, &bytes).expect("to write");
        let (times, faults) = read(&path);
        assert_eq!(times, without(&[3]));
        // All bytes before the next whole record are one damage.
        assert_eq!((faults.damaged, &faults.cut), (1, &None), "{faults}");
    }
}

#[test]
fn damage_anywhere_costs_a_chunk_at_most() {
    // Small, because it is read a thousand times.
    const CHUNKS: u64 = 4;
    const MESSAGES: u64 = 8;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let whole = write_chunks(&path, CHUNKS, MESSAGES);
    let mut random: u64 = 1;
    for _ in 0..1000 {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let at = 8 + (random >> 33) as usize % (whole.len() - 8);
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (random % 8);
        std::fs::write(&path, &bytes).expect("to write");
        let (times, faults) = read(&path);
        assert!(times.is_sorted(), "{at}");
        let missing = CHUNKS * MESSAGES - times.len() as u64;
        assert!(missing <= MESSAGES, "{at}: {missing} are missing, {faults}");
        assert!(missing == 0 || !faults.is_none(), "{at}");
    }
}

#[test]
fn a_recording_without_hops_has_no_chains() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("none.mcap");
    write(&path);
    let error = rc_record::chains::read(&path).expect_err("no chains");
    let text = error.to_string();
    assert!(
        text.contains("none.mcap: the recording has no chains: "),
        "{text}"
    );
}
