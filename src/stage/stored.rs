//! Tables that a stage reads: whole, or chunk by chunk where they may be longer than memory.

use super::{Arity, PortValue};
use crate::error::Result;
use crate::table::{Frame, Table};
use std::marker::PhantomData;

/// A table that is there to be read.
pub trait StoredTable: Send + Sync {
    /// How many rows.
    fn rows(&self) -> usize;
    /// All of it. Fails where it is damaged.
    fn frame(&self) -> Result<Frame>;
    /// Hands on all rows in their order, chunk after chunk, as often as it is called; of a table without rows, one empty chunk. Fails where
    /// it is damaged, and with what `take` fails with.
    fn chunks(&self, take: &mut dyn FnMut(&Frame) -> Result<()>) -> Result<()>;
}

impl StoredTable for Frame {
    fn rows(&self) -> usize {
        Self::rows(self)
    }
    fn frame(&self) -> Result<Frame> {
        Ok(self.clone())
    }
    fn chunks(&self, take: &mut dyn FnMut(&Frame) -> Result<()>) -> Result<()> {
        take(self)
    }
}

/// The table of a port.
pub type InputTable = Box<dyn StoredTable>;

/// A field of a `reads!` struct whose table is read chunk by chunk.
pub struct Chunks<T>(InputTable, PhantomData<fn() -> T>);

impl<T: Table> Chunks<T> {
    /// How many rows.
    pub fn rows(&self) -> usize {
        self.0.rows()
    }

    /// Hands on all rows in their order, as [`StoredTable::chunks`].
    pub fn each(&self, mut take: impl FnMut(T) -> Result<()>) -> Result<()> {
        self.0.chunks(&mut |frame| take(T::from_frame(frame)?))
    }
}

impl<T: Table> PortValue for Chunks<T> {
    const ARITY: Arity = Arity::One;
    const KIND: &'static str = T::KIND;
    const CHUNKED: bool = true;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        Ok(Self(
            inputs
                .into_iter()
                .next()
                .expect("the plan wired this port")
                .1,
            PhantomData,
        ))
    }
}
