//! Data association: heads of an image are matched with the tracks of earlier images.

use crate::Point;
use crate::heads::Head;

/// The greatest speed of a person in mm/s.
const FASTEST: f64 = 2500.0;
/// A head is not looked for farther from where it was, in mm.
const FARTHEST: f64 = 1000.0;
/// The error of a place in mm.
const ERROR: f64 = 50.0;
/// A head belongs to a person once it is so far from where it was seen first, in mm, and was in so
/// many images, without a gap: things do not walk.
const WALKED: f64 = 300.0;
const IMAGES: u32 = 5;
/// The most heads that are followed.
const MOST: usize = 100;

#[derive(Debug)]
struct Track {
    id: i32,
    begun: Point,
    place: Point,
    /// The time of the last image that showed it, in ms.
    seen: i64,
    images: u32,
    is_person: bool,
}

/// The heads that are followed.
#[derive(Debug, Default)]
pub(crate) struct Tracks {
    tracks: Vec<Track>,
    last_id: i32,
    time: i64,
}

impl Tracks {
    /// Matches the heads of an image with the tracks. Returns the heads of people, each with the id
    /// of its person. Times are in ms; a person is forgotten when no head is seen there for longer
    /// than `patience`, and all are when time jumps back.
    pub(crate) fn follow(&mut self, heads: &[Head], time: i64, patience: i64) -> Vec<(i32, Head)> {
        if time < self.time {
            self.tracks.clear();
        }
        let before = std::mem::replace(&mut self.time, time);
        self.tracks.retain(|track| {
            if track.is_person {
                time.saturating_sub(track.seen) <= patience
            } else {
                track.seen == before
            }
        });
        let (mut is_found, mut is_taken) =
            (vec![false; self.tracks.len()], vec![false; heads.len()]);
        let mut people = Vec::new();
        for (at, number) in self.pairs(heads) {
            if is_found[at] || is_taken[number] {
                continue;
            }
            (is_found[at], is_taken[number]) = (true, true);
            let (track, head) = (&mut self.tracks[at], &heads[number]);
            (track.place, track.seen) = (head.centre, time);
            track.images = track.images.saturating_add(1);
            let has_walked = distance(track.begun, track.place) > WALKED;
            track.is_person |= has_walked && track.images >= IMAGES;
            if track.is_person {
                people.push((track.id, *head));
            }
        }
        for (head, is_taken) in heads.iter().zip(is_taken) {
            if !is_taken && self.tracks.len() < MOST {
                self.last_id = self.last_id.checked_add(1).unwrap_or(1);
                self.tracks.push(Track {
                    id: self.last_id,
                    begun: head.centre,
                    place: head.centre,
                    seen: time,
                    images: 1,
                    is_person: false,
                });
            }
        }
        people.sort_by_key(|(id, _)| *id);
        people
    }

    /// The numbers of a track and of a head that it may be, the nearest pairs first.
    fn pairs(&self, heads: &[Head]) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        for (at, track) in self.tracks.iter().enumerate() {
            let unseen = self.time.saturating_sub(track.seen) as f64 / 1000.0;
            let reach = (ERROR + FASTEST * unseen).min(FARTHEST);
            for (number, head) in heads.iter().enumerate() {
                let far = distance(track.place, head.centre);
                if far <= reach {
                    pairs.push((far, at, number));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs
            .into_iter()
            .map(|(_, at, number)| (at, number))
            .collect()
    }
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(x: f64, z: f64) -> Head {
        Head {
            centre: [x, 1600.0, z],
            score: 1.0,
        }
    }

    fn ids(people: &[(i32, Head)]) -> Vec<(i32, f64)> {
        people
            .iter()
            .map(|(id, head)| (*id, head.centre[0]))
            .collect()
    }

    #[test]
    fn who_walks_is_a_person_and_what_stands_is_none() {
        let mut tracks = Tracks::default();
        let lamp = head(500.0, 3000.0);
        for step in 0..20_i32 {
            let x = -500.0 + 100.0 * f64::from(step);
            let heads = [lamp, head(x, 2600.0)];
            let people = tracks.follow(&heads, 100 * i64::from(step), 1000);
            let expected: Vec<_> = (step > 3).then_some((2, x)).into_iter().collect();
            assert_eq!(ids(&people), expected, "{step}");
        }
        // A person who stands stays one.
        let people = tracks.follow(&[lamp, head(1400.0, 2600.0)], 2000, 1000);
        assert_eq!(ids(&people), [(2, 1400.0)]);
    }

    #[test]
    fn people_who_meet_keep_their_numbers() {
        let mut tracks = Tracks::default();
        for step in 0..20_i32 {
            let x = 100.0 * f64::from(step);
            // The order of the heads means nothing.
            let mut heads = [head(x, 2000.0), head(1900.0 - x, 2600.0)];
            if step % 2 == 1 {
                heads.reverse();
            }
            let people = tracks.follow(&heads, 100 * i64::from(step), 1000);
            if step > 3 {
                assert_eq!(ids(&people), [(1, x), (2, 1900.0 - x)], "{step}");
            }
        }
    }

    #[test]
    fn a_person_who_is_hidden_for_a_while_keeps_the_number() {
        let mut tracks = Tracks::default();
        let mut walk = |from: i32, to: i32| {
            let mut people = Vec::new();
            for step in from..to {
                let heads = [head(100.0 * f64::from(step), 2000.0)];
                people = tracks.follow(&heads, 100 * i64::from(step), 500);
            }
            ids(&people).first().map(|(id, _)| *id)
        };
        assert_eq!(walk(0, 10), Some(1));
        assert_eq!(walk(13, 20), Some(1));
        assert_eq!(walk(30, 40), Some(2));
        // Time that begins again is another run.
        assert_eq!(walk(0, 2), None);
        assert_eq!(walk(2, 10), Some(3));
    }

    #[test]
    fn what_is_there_in_some_images_only_is_no_person() {
        let mut tracks = Tracks::default();
        for step in 0..60_i32 {
            // Each fifth image lacks it.
            let place = head(100.0 * f64::from(step), 2000.0);
            let heads: Vec<Head> = (step % 5 > 0).then_some(place).into_iter().collect();
            let people = tracks.follow(&heads, 100 * i64::from(step), 1000);
            assert!(people.is_empty(), "{step}");
        }
    }

    #[test]
    fn no_image_makes_more_tracks_than_there_may_be() {
        let mut tracks = Tracks::default();
        let heads: Vec<Head> = (0..200)
            .map(|at| head(f64::from(at) * 400.0, 0.0))
            .collect();
        tracks.follow(&heads, 0, 1000);
        assert_eq!(tracks.tracks.len(), MOST);
    }
}
