//! What a set of concealed recordings is drawn from, and which kind each of its cases is.

use super::family::{Collection, DrawEffect};
use super::points::Layout;
use super::robots::Kind;
use crate::lists::Family;
use crate::noise::{Noise, Purpose};
use crate::tracker::Scatter;

/// Shares and bounds of a set of cases; everything else comes from the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The same seed gives the same cases.
    pub seed: u64,
    pub cases: usize,
    /// The list that effects are drawn from.
    pub collection: Collection,
    /// Canonical names that single effects and pairs are drawn from; empty: all, of the library but `unknown`.
    pub families: Vec<String>,
    /// Empty: all.
    pub robots: Vec<Kind>,
    /// Points to fit; none: 50 to 400, evenly on a logarithmic scale.
    pub points: Option<usize>,
    /// Shares of cases without an effect, with two, with one outside every list; the rest has one.
    pub nulls: f64,
    pub pairs: f64,
    /// With an effect outside every list.
    pub open: f64,
    /// With an effect that is drawn at random, shape and place.
    pub foreign: f64,
    /// Share of effects in another form than the obvious one.
    pub other_forms: f64,
    /// Share of effects of natural size; the others are sized to a drawn visibility.
    pub natural: f64,
    /// Share of cases with gross errors or exchanged points in the recording.
    pub faulty: f64,
    /// How every tracker scatters; none: Gaussian, of recordings without an effect also heavy-tailed and uneven.
    pub scatter: Option<Scatter>,
    /// As most cells have it: the robot file gives no masses, nothing hangs on the tool, no motor currents are recorded.
    pub bare: bool,
    /// Step (deg) to which joints are rounded in the log; 0: none.
    pub log_step_deg: f64,
    /// How poses follow each other.
    pub layout: Layout,
    /// Mass (kg) on the flange that neither the robot file nor the payload column states.
    pub tool_mass_kg: f64,
    /// Torques of an arm that moves instead of points: of what is above, seed, cases, shares (nulls have friction of all joints in half of
    /// them, the others in most) and forms count.
    pub dynamics: bool,
    /// Commands and angles of drives instead of points: seed, cases and shares count.
    pub drives: bool,
    /// Seconds of a recording of torques: two stretches to fit, two that judge.
    pub seconds: f64,
    /// Rows a second of it.
    pub rate: f64,
}

impl Default for Design {
    fn default() -> Self {
        Self {
            seed: 1,
            cases: 20,
            collection: Collection::Library,
            families: Vec::new(),
            robots: Vec::new(),
            points: None,
            nulls: 0.0,
            pairs: 0.0,
            open: 0.0,
            foreign: 0.0,
            other_forms: 0.5,
            natural: 0.2,
            faulty: 0.08,
            scatter: None,
            bare: false,
            log_step_deg: 0.0,
            layout: Layout::default(),
            tool_mass_kg: 0.0,
            dynamics: false,
            drives: false,
            seconds: 48.0,
            rate: 100.0,
        }
    }
}

/// What a case conceals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Content {
    /// No effect.
    Null,
    /// One effect of this row of the collection's families.
    Single(usize),
    /// Two effects, of these rows.
    Pair(usize, usize),
    /// One effect that is in no list, its shape and place drawn at random.
    Foreign,
}

impl Design {
    /// Rows of the families that single effects are drawn from.
    fn listed(&self) -> Vec<usize> {
        let chosen = |family: &Family<DrawEffect>| match self.families.is_empty() {
            true => self.collection == Collection::Beyond || family.name != "unknown",
            false => self.families.iter().any(|name| name == family.name),
        };
        let families = self.collection.families();
        (0..families.len())
            .filter(|row| chosen(&families[*row]))
            .collect()
    }

    /// Robots to draw from.
    pub(crate) fn kinds(&self) -> &[Kind] {
        match self.robots.is_empty() {
            true => self.collection.robots(),
            false => &self.robots,
        }
    }

    /// What every case conceals: shares kept exactly, families in turn, in an order that says nothing.
    pub fn contents(&self) -> Vec<Content> {
        let mut draw = Noise::new(self.seed, Purpose::Design);
        let count = |share: f64| (share * self.cases as f64).round() as usize;
        let listed = self.listed();
        let families = self.collection.families();
        let is_open = |row: &usize| families[*row].name == "unknown";
        let open: Vec<usize> = (0..families.len()).filter(is_open).collect();
        let is_paired = |row: &usize| families[*row].paired;
        let paired: Vec<usize> = listed.iter().copied().filter(is_paired).collect();
        let mut out = vec![Content::Null; count(self.nulls).min(self.cases)];
        let room = |out: &Vec<Content>, wanted: usize| wanted.min(self.cases - out.len());
        for turn in 0..room(&out, count(self.open)) {
            out.push(Content::Single(open[turn % open.len()]));
        }
        let foreign = room(&out, count(self.foreign));
        out.extend(vec![Content::Foreign; foreign]);
        let pairs = if paired.len() > 1 {
            room(&out, count(self.pairs))
        } else {
            0
        };
        for _ in 0..pairs {
            let first = draw.index(paired.len());
            let second = (first + 1 + draw.index(paired.len() - 1)) % paired.len();
            out.push(Content::Pair(paired[first], paired[second]));
        }
        for turn in 0..self.cases - out.len() {
            out.push(match listed.get(turn % listed.len().max(1)) {
                Some(row) => Content::Single(*row),
                None => Content::Null,
            });
        }
        draw.shuffle(&mut out);
        out
    }

    /// The seed of a case: splitmix64 of the design's seed and the case's number.
    pub(crate) fn seed_of(&self, case: usize) -> u64 {
        let mut z = self
            .seed
            .wrapping_add((case as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}
