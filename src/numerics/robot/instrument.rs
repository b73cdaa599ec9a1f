//! Instruments: how far a measured point scatters, as makers publish it or as a person states it in numbers.
//!
//! One sigma of every axis is (constant + per_metre * range) / coverage. Where a maker states a maximum permissible error (MPE) the
//! divisor is 2: makers call half of it typical (Leica AT500 manual, 2.8.1). A calibration certificate says more than any of these.

use calib_foundation::named;
use nalgebra::Vector3;

/// Noise of a point by its range.
#[derive(
    Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    /// Constant part of the stated figure, um.
    pub constant_um: f64,
    /// Part that grows with range, um per metre; none where it is not stated.
    #[serde(default)]
    pub per_metre_um: f64,
    /// How many sigmas the stated figures are; the divisor.
    pub coverage: f64,
}

/// An instrument by its name, with the document that states its figures.
#[derive(Debug, Clone, Copy)]
pub struct PublishedInstrument {
    /// As the YAML names it.
    pub name: &'static str,
    /// Its accuracy.
    pub figures: Instrument,
    /// Data sheet that states it.
    pub source: &'static str,
}

macro_rules! instruments {
    ($($name:ident [$constant_um:literal, $per_metre_um:literal, $coverage:literal] $source:literal;)+) => {
        /// What may be named, one line each: constant part (um), growth (um/m) and divisor, and where they stand.
        pub const INSTRUMENTS: &[PublishedInstrument] = &[$(PublishedInstrument {
            name: stringify!($name),
            figures: Instrument { constant_um: $constant_um, per_metre_um: $per_metre_um, coverage: $coverage },
            source: $source,
        }),+];
    };
}

instruments! {
    api_radian [10.0, 5.0, 2.0] "API, Radian series, data sheet: static point 10 um + 5 um/m, two sigma";
    faro_vantage [20.0, 5.0, 2.0] "FARO, Vantage laser trackers, technical sheet: transverse 20 um + 5 um/m, MPE";
    leica_at402 [15.0, 6.0, 2.0] "Leica, AT402, product sheet: U(x, y, z) 15 um + 6 um/m, MPE";
    leica_at500 [15.0, 6.0, 2.0] "Leica, AT500, user manual, 2.8.2: transverse 15 um + 6 um/m, MPE by ISO 10360-10:2021";
    leica_at960 [15.0, 6.0, 2.0] "Leica, AT960, product sheet: U(x, y, z) 15 um + 6 um/m, MPE";
    mocap_optitrack [100.0, 0.0, 2.0] "OptiTrack, PrimeX 41, data sheet: 3-D accuracy +-0.10 mm; its extreme counts as MPE";
}

/// The weight to start from where a recording states neither standard deviations nor an instrument: a laser tracker of 10 um + 2.5 um/m,
/// two sigma (Wang et al. 2020, Sec. 6). How far such points scatter is then inferred from what a model leaves.
pub const START: Instrument = Instrument {
    constant_um: 10.0,
    per_metre_um: 2.5,
    coverage: 2.0,
};

impl Instrument {
    /// The figures of an instrument by name.
    pub fn named(name: &str) -> Option<Self> {
        INSTRUMENTS
            .iter()
            .find(|known| known.name == name)
            .map(|known| known.figures)
    }

    /// One standard deviation per axis (m) at a point in the tracker's frame.
    pub fn sigma(&self, position: &Vector3<f64>) -> f64 {
        (self.constant_um + self.per_metre_um * position.norm()) * 1e-6 / self.coverage
    }

    /// What is wrong with the figures, if anything.
    pub fn fault(&self) -> Option<&'static str> {
        let fine = self.constant_um >= 0.0 && self.per_metre_um >= 0.0 && self.coverage > 0.0;
        let something = self.constant_um + self.per_metre_um > 0.0;
        (!fine || !something).then_some(
            "expected a noise above zero and a coverage above zero, e.g. {constant_um: 10, per_metre_um: 2.5, coverage: 2}",
        )
    }
}

named! {
    /// Where the standard deviation of a row's point comes from.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum SigmaSource {
        /// The recording states it.
        Recorded "recorded",
        /// By the instrument that was named.
        Instrument "instrument",
        /// Neither: [`START`].
        Inferred "inferred",
    }
}

named! {
    /// What figures of noise rest on, the firmest first.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
    pub enum NoiseBasis {
        /// Poses that were measured again.
        Repeats "repeats",
        /// Standard deviations that were recorded, or an instrument that was stated.
        #[default]
        Instrument "instrument",
        /// What a model leaves.
        Inferred "inferred",
    }
}

impl NoiseBasis {
    /// The basis of a name in a table.
    pub fn parse(name: &str) -> Option<Self> {
        let mut all = Self::ALL.iter().copied();
        all.find(|basis| basis.name() == name)
    }
}
