//! The activations of the hidden layer: the same bits for one value and for many, on every machine.
//!
//! The sigmoid is `1 / (1 + 2^t)` with `t = -z log2 e = n + f`, `|f| <= 1/2`, where `2^f = (E + O) / (E - O)` is Padé's quotient of
//! order 5 for the exponential, within 1e-15; one division does for both. Without branches and library calls it compiles to vector
//! instructions. The factor of `z` is left to the caller, who has it in the weights.

use std::f64::consts::{LN_2, LOG2_E};

/// The activation of the hidden layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// 1 / (1 + exp(-z)).
    Sigmoid,
    /// tanh z.
    Tanh,
}

/// Exponents beyond it make a sigmoid 0 or 1, while powers of 2 up to it are finite, also multiplied by `E` and `O`.
pub(super) const FARTHEST: f64 = 1000.0;
/// Added to a number of less than 2^51 it leaves that number, rounded and with a double's bias of the exponent, in the last bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0 + 1023.0;
/// Where a double has its exponent.
const EXPONENT: u32 = 52;
/// Coefficients of `E` (even powers of `f`) and `O` (odd ones): 30240 + 15120 x + 3360 x^2 + 420 x^3 + 30 x^4 + x^5 at `x = f ln 2`,
/// divided by that of `f^5`.
const EVEN: [f64; 3] = [
    30240.0 / (LN_2 * LN_2 * LN_2 * LN_2 * LN_2),
    3360.0 / (LN_2 * LN_2 * LN_2),
    30.0 / LN_2,
];
const ODD: [f64; 2] = [15120.0 / (LN_2 * LN_2 * LN_2 * LN_2), 420.0 / (LN_2 * LN_2)];

/// `1 / (1 + 2^t)` for `t` within [`FARTHEST`].
#[inline(always)]
fn sigmoid(t: f64) -> f64 {
    let rounded = t + ROUNDER;
    let f = t - (rounded - ROUNDER);
    let square = f * f;
    let odd = f * (ODD[0] + square * (ODD[1] + square));
    let even = EVEN[0] + square * (EVEN[1] + square * EVEN[2]);
    let power = f64::from_bits(rounded.to_bits() << EXPONENT);
    let below = even - odd;
    below / (below + power * (even + odd))
}

impl Activation {
    /// What a hidden neuron's sum is multiplied by to be the exponent `t` of [`Activation::apply`].
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::Sigmoid => -LOG2_E,
            Self::Tanh => -2.0 * LOG2_E,
        }
    }

    /// Its value at z.
    pub fn value(self, z: f64) -> f64 {
        let mut value = [(z * self.factor()).clamp(-FARTHEST, FARTHEST)];
        self.apply(&mut value);
        value[0]
    }

    /// Every exponent, none beyond [`FARTHEST`], replaced by the value of the activation.
    #[inline(always)]
    pub(super) fn apply(self, exponents: &mut [f64]) {
        match self {
            Self::Sigmoid => {
                for t in exponents {
                    *t = sigmoid(*t);
                }
            }
            Self::Tanh => {
                for t in exponents {
                    *t = 2.0 * sigmoid(*t) - 1.0;
                }
            }
        }
    }

    /// Multiplies `delta` by the derivative, from the values: Eq. 43 for the sigmoid.
    #[inline(always)]
    pub(super) fn slope(self, delta: &mut [f64], values: &[f64]) {
        match self {
            Self::Sigmoid => {
                for (d, a) in delta.iter_mut().zip(values) {
                    *d *= a * (1.0 - a);
                }
            }
            Self::Tanh => {
                for (d, a) in delta.iter_mut().zip(values) {
                    *d *= 1.0 - a * a;
                }
            }
        }
    }
}
