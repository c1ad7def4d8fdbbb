//! Lines of the sensor: `$VNYMR,YAW,PITCH,ROLL,MAG X,Y,Z,ACC X,Y,Z,GYRO X,Y,Z*CHECKSUM`, in degrees,
//! gauss, m/s² and rad/s, in the axes ahead, right and down.

/// The values of one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Degrees: to the right, up, and to the right side.
    pub(crate) yaw: f32,
    pub(crate) pitch: f32,
    pub(crate) roll: f32,
    pub(crate) magnetic: [f32; 3],
    pub(crate) acceleration: [f32; 3],
    pub(crate) turning: [f32; 3],
}

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Line {
    Sample(Sample),
    /// Another message of the sensor.
    Other,
    /// Noise, or a line that lost bytes.
    Damaged,
}

/// Reads a line. What comes before its last `$` is noise.
pub(crate) fn read(line: &[u8]) -> Line {
    let text = line.iter().rposition(|byte| *byte == b'$');
    let text = text.and_then(|at| std::str::from_utf8(&line[at + 1..]).ok());
    let Some((text, checksum)) = text.and_then(|text| text.trim_end().split_once('*')) else {
        return Line::Damaged;
    };
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    let is_whole = checksum.len() == 2 && u8::from_str_radix(checksum, 16) == Ok(sum);
    if !is_whole {
        return Line::Damaged;
    }
    let Some(numbers) = text.strip_prefix("VNYMR,") else {
        return Line::Other;
    };
    let mut all = [0.0; 12];
    let mut given = numbers.split(',');
    for number in &mut all {
        let value = given.next().and_then(|text| text.parse::<f32>().ok());
        let Some(value) = value.filter(|value| value.is_finite()) else {
            return Line::Damaged;
        };
        *number = value;
    }
    if given.next().is_some() {
        return Line::Damaged;
    }
    let three = |at: usize| [all[at], all[at + 1], all[at + 2]];
    Line::Sample(Sample {
        yaw: all[0],
        pitch: all[1],
        roll: all[2],
        magnetic: three(3),
        acceleration: three(6),
        turning: three(9),
    })
}

/// Puts bytes together to lines.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    begun: Vec<u8>,
    /// Whether the beginning of the line is unknown or was too long.
    is_skipped: bool,
}

impl Lines {
    /// The longest line that is kept. Those of the sensor have some 120 bytes.
    const LONGEST: usize = 512;

    /// Begins in the middle of a line, as a port does that was just opened.
    pub(crate) fn in_the_middle() -> Self {
        Self {
            begun: Vec::new(),
            is_skipped: true,
        }
    }

    /// Gives each line that these bytes end to `take`. A line that was too long is damaged.
    pub(crate) fn add(&mut self, bytes: &[u8], mut take: impl FnMut(Line)) {
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            let ends = part.ends_with(b"\n");
            if !self.is_skipped {
                let is_too_long = self.begun.len() + part.len() > Self::LONGEST;
                if is_too_long {
                    self.begun.clear();
                    self.is_skipped = true;
                    take(Line::Damaged);
                } else {
                    self.begun.extend_from_slice(part);
                    if ends {
                        take(read(&self.begun));
                    }
                }
            }
            if ends {
                self.begun.clear();
                self.is_skipped = false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sensor at rest, that lies flat.
    const WHOLE: &[u8] = b"$VNYMR,+006.380,+000.023,-001.953,+1.0640,-0.2531,+3.0614,+00.005,+00.344,-09.758,-0.001222,-0.000450,-0.001218*67\r\n";

    fn sample(line: Line) -> Sample {
        let Line::Sample(sample) = line else {
            panic!("{line:?}");
        };
        sample
    }

    #[test]
    fn a_line_has_twelve_numbers() {
        let found = sample(read(WHOLE));
        assert_eq!((found.yaw, found.pitch, found.roll), (6.38, 0.023, -1.953));
        assert_eq!(found.acceleration, [0.005, 0.344, -9.758]);
        assert_eq!(found.turning, [-0.001222, -0.00045, -0.001218]);
        // Noise before a line that came whole.
        let noise = [b"\x00\xff$VNY", WHOLE].concat();
        assert_eq!(sample(read(&noise)), found);
    }

    #[test]
    fn no_changed_byte_and_no_lost_one_gives_a_sample() {
        for at in 0..WHOLE.len() - 2 {
            for flipped in 0..8 {
                let mut line = WHOLE.to_vec();
                line[at] ^= 1 << flipped;
                let is_sample = matches!(read(&line), Line::Sample(_));
                assert!(!is_sample, "{at}: {}", String::from_utf8_lossy(&line));
            }
            let lost = [&WHOLE[..at], &WHOLE[at + 1..]].concat();
            assert!(!matches!(read(&lost), Line::Sample(_)), "{at}");
        }
    }

    #[test]
    fn numbers_that_are_none_are_damage() {
        let line = |numbers: &str| {
            let text = format!("VNYMR,{numbers}");
            let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
            read(format!("${text}*{sum:02X}\n").as_bytes())
        };
        let many = |last: &str| line(&format!("{}{last}", "1.0,".repeat(11)));
        assert!(matches!(many("2"), Line::Sample(_)));
        for last in ["nan", "inf", "1e99", "", "x", "2,3"] {
            assert_eq!(many(last), Line::Damaged, "{last}");
        }
        assert_eq!(read(b"$VNERR,03*72\r\n"), Line::Other);
    }

    #[test]
    fn lines_begin_after_the_first_end_and_have_a_bound() {
        let mut lines = Lines::in_the_middle();
        let mut found = Vec::new();
        // One byte at a time.
        let bytes = [&WHOLE[30..], WHOLE, &[b'x'; 5000], WHOLE, WHOLE].concat();
        for byte in &bytes {
            lines.add(&[*byte], |line| found.push(line));
            assert!(lines.begun.len() <= Lines::LONGEST);
        }
        let whole = read(WHOLE);
        assert_eq!(found, [whole, Line::Damaged, whole]);
        let mut lines = Lines::in_the_middle();
        let mut at_once = Vec::new();
        lines.add(&bytes, |line| at_once.push(line));
        assert_eq!(found, at_once);
    }
}
