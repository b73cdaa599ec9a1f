//! Common arms, one robot file each below `library`: axes, senses and zeros as their controllers count, ranges, reach, and masses where a
//! maker or a public model states them. Each file names its sources and what it leaves out.

use super::import::{Imported, RobotFileText, read_calib};
use crate::error::{Error, Result, did_you_mean};

/// An arm of the library.
#[derive(Debug, PartialEq, Eq)]
pub struct LibraryArm {
    /// As the command line names it.
    pub name: &'static str,
    /// Its robot file, YAML.
    pub text: &'static str,
}

impl LibraryArm {
    /// The robot, and what its file says of itself. Fails with the faults of the file.
    pub fn read(&self) -> Result<Imported> {
        read_calib(RobotFileText::new(self.name, self.text), None)
    }

    /// The same, or which name is near.
    pub fn named(name: &str) -> Result<&'static Self> {
        Self::find(name).ok_or_else(|| {
            let near = did_you_mean(name, LIBRARY.iter().map(|arm| arm.name));
            Error::spec(
                "NAME",
                format!("no arm `{name}` in the library{near} (`calib robots` lists all)"),
            )
        })
    }

    /// The arm of that name; capitals, blanks and dashes do not matter.
    pub fn find(name: &str) -> Option<&'static Self> {
        let plain = |text: &str| {
            text.chars()
                .filter(char::is_ascii_alphanumeric)
                .collect::<String>()
                .to_ascii_lowercase()
        };
        LIBRARY.iter().find(|arm| plain(arm.name) == plain(name))
    }
}

macro_rules! arms {
    ($($name:literal),* $(,)?) => {
        /// All of them, in the order of their names.
        pub const LIBRARY: &[LibraryArm] =
            &[$(LibraryArm { name: $name, text: include_str!(concat!("library/", $name, ".yaml")) }),*];
    };
}

arms![
    "gen3_7",
    "gp12",
    "gp25",
    "gp7",
    "iiwa14",
    "iiwa7",
    "irb120",
    "irb1200_5_90",
    "irb1600_10_145",
    "irb2600_12_165",
    "irb4600_40_255",
    "irb6640_185_280",
    "irb6700_200_260",
    "kr10_r1100",
    "kr16_2",
    "kr210_r2700",
    "kr6_r900",
    "lrmate_200id",
    "lrmate_200id_7l",
    "m1013",
    "m10ia",
    "m20ia",
    "panda",
    "r2000ic_210f",
    "rx160",
    "tm12",
    "tx2_60",
    "tx2_90",
    "ur10",
    "ur10e",
    "ur16e",
    "ur20",
    "ur3e",
    "ur5",
    "ur5e",
];
