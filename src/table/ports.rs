//! The ports of stages: which tables a stage reads and writes, whole, or chunk by chunk where they may be longer than memory.

use super::{Frame, Table};
use crate::error::Result;
use crate::store::{FinishedFile, PublishedTable};
use std::marker::PhantomData;
use std::ops::Deref;

/// How many upstream tables a port takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arity {
    /// The latest upstream stage that writes this kind, or the one named in `reads:`.
    One,
    /// The same, or none.
    Optional,
    /// All upstream stages that write this kind, in pipeline order.
    Every,
}

/// A named input or output of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Port {
    /// In `reads:` of the YAML.
    pub name: &'static str,
    /// The name of the schema.
    pub kind: &'static str,
    /// How many tables it takes.
    pub arity: Arity,
    /// Whether its table is read chunk by chunk.
    pub chunked: bool,
}

/// What a field of a `reads!` struct may be: `T`, `Option<T>`, `Vec<Labelled<T>>`, `Chunks<T>`, or `Chunks<T>` with their labels.
pub trait PortValue: Sized {
    /// How many tables it takes.
    const ARITY: Arity;
    /// The name of the schema.
    const KIND: &'static str;
    /// Whether it is read chunk by chunk.
    const CHUNKED: bool = false;
    /// The value from the tables that were wired to the port.
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self>;
}

/// A table together with the id of the stage that wrote it.
#[derive(Debug, Clone)]
pub struct Labelled<T> {
    /// Its id.
    pub stage: String,
    /// What it wrote.
    pub table: T,
}

impl<T> Deref for Labelled<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.table
    }
}

impl<T: Table> PortValue for T {
    const ARITY: Arity = Arity::One;
    const KIND: &'static str = T::KIND;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        T::from_frame(
            &inputs
                .first()
                .expect("the plan wired this port")
                .1
                .frame()?,
        )
    }
}
impl<T: Table> PortValue for Option<T> {
    const ARITY: Arity = Arity::Optional;
    const KIND: &'static str = T::KIND;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        inputs
            .first()
            .map(|(_, input)| T::from_frame(&input.frame()?))
            .transpose()
    }
}
impl<T: Table> PortValue for Vec<Labelled<T>> {
    const ARITY: Arity = Arity::Every;
    const KIND: &'static str = T::KIND;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        inputs
            .into_iter()
            .map(|(stage, input)| {
                Ok(Labelled {
                    stage,
                    table: T::from_frame(&input.frame()?)?,
                })
            })
            .collect()
    }
}

/// The input ports of a stage.
pub trait Reads: Sized {
    /// In the order of the fields.
    fn ports() -> Vec<Port>;
    /// Takes the tables of each port, in the order of [`Reads::ports`].
    fn take(inputs: Vec<Vec<(String, InputTable)>>) -> Result<Self>;
}

/// The output ports of a stage.
pub trait Writes: Sized {
    /// In the order of the fields.
    fn ports() -> Vec<Port>;
    /// Checked columns, in the order of the ports. Fails where a value breaks its schema.
    fn give(self) -> Result<Vec<Output>>;
}

/// What a stage hands back on one port: columns in memory, or a table already streamed through `Services::sink`.
pub enum Output {
    /// Columns in memory.
    Frame(Frame),
    /// A finished file.
    Streamed(Streamed),
}

/// Declares input ports: `reads! { pub struct IdentifyReads { robot: Robot, parameters: Option<Parameters>, } }`.
#[macro_export]
macro_rules! reads {
    ($(#[$doc:meta])* pub struct $name:ident { $( $field:ident: $ty:ty, )* }) => {
        $(#[$doc])*
        pub struct $name { $(
            #[doc = concat!("The port `", stringify!($field), "`.")]
            pub $field: $ty,
        )* }
        impl $crate::ports::Reads for $name {
            fn ports() -> Vec<$crate::ports::Port> {
                vec![ $( $crate::ports::Port { name: stringify!($field), kind: <$ty as $crate::ports::PortValue>::KIND, arity: <$ty as $crate::ports::PortValue>::ARITY, chunked: <$ty as $crate::ports::PortValue>::CHUNKED } ),* ]
            }
            #[allow(unused_mut, unused_variables)]
            fn take(inputs: Vec<Vec<(String, $crate::ports::InputTable)>>) -> ::calib_foundation::error::Result<Self> {
                let mut inputs = inputs.into_iter();
                Ok(Self { $( $field: <$ty as $crate::ports::PortValue>::take(inputs.next().expect("one entry per port"))?, )* })
            }
        }
    };
}

/// What a field of a `writes!` struct may be: a table, or a [`Streamed`] one.
pub trait Produced {
    /// The name of the schema.
    const KIND: &'static str;
    /// Checked columns, or the finished file.
    fn give(self) -> Result<Output>;
}
impl<T: Table> Produced for T {
    const KIND: &'static str = T::KIND;
    fn give(self) -> Result<Output> {
        self.to_frame().map(Output::Frame)
    }
}

/// Declares output ports: `writes! { pub struct IdentifyWrites { parameters: Parameters, } }`.
#[macro_export]
macro_rules! writes {
    ($(#[$doc:meta])* pub struct $name:ident { $( $field:ident: $ty:ty, )* }) => {
        $(#[$doc])*
        pub struct $name { $(
            #[doc = concat!("The port `", stringify!($field), "`.")]
            pub $field: $ty,
        )* }
        impl $crate::ports::Writes for $name {
            fn ports() -> Vec<$crate::ports::Port> {
                vec![ $( $crate::ports::Port { name: stringify!($field), kind: <$ty as $crate::ports::Produced>::KIND, arity: $crate::ports::Arity::One, chunked: false } ),* ]
            }
            fn give(self) -> ::calib_foundation::error::Result<Vec<$crate::ports::Output>> {
                Ok(vec![ $( $crate::ports::Produced::give(self.$field)? ),* ])
            }
        }
    };
}

/// A table written chunk by chunk, for what does not fit into memory.
pub struct Streamed {
    /// The name of the schema.
    pub kind: &'static str,
    /// Finished; none where the engine keeps tables elsewhere.
    pub file: Option<FinishedFile>,
}

/// A streamed table with its kind as a type, for a field of a `writes!` struct.
pub struct StreamedTable<T>(Streamed, PhantomData<fn() -> T>);

impl<T: Table> StreamedTable<T> {
    /// A finished table of this kind; panics where it is another.
    pub fn new(streamed: Streamed) -> Self {
        assert_eq!(streamed.kind, T::KIND, "a sink of another kind");
        Self(streamed, PhantomData)
    }
}
impl<T: Table> Produced for StreamedTable<T> {
    const KIND: &'static str = T::KIND;
    fn give(self) -> Result<Output> {
        Ok(Output::Streamed(self.0))
    }
}

/// Takes chunks of one table, in key order, and checks each against the schema.
pub trait Sink: Send {
    /// Takes rows. Fails where they break the schema or the order of the key.
    fn push(&mut self, chunk: Frame) -> Result<()>;
    /// Ends the table.
    fn finish(self: Box<Self>) -> Result<Streamed>;
}

/// The table of a port.
pub enum InputTable {
    /// In memory.
    Frame(Frame),
    /// In the store, to be read chunk by chunk.
    Stored(PublishedTable),
}

impl InputTable {
    fn rows(&self) -> usize {
        match self {
            Self::Frame(frame) => frame.rows(),
            Self::Stored(table) => table.rows(),
        }
    }
    /// All of it. Fails where it is damaged.
    fn frame(&self) -> Result<Frame> {
        match self {
            Self::Frame(frame) => Ok(frame.clone()),
            Self::Stored(table) => table.frame(),
        }
    }
    /// Hands on all rows in their order, chunk after chunk, as often as it is called; of a table without rows, one empty chunk. Fails where
    /// it is damaged, and with what `take` fails with.
    fn chunks(&self, take: &mut dyn FnMut(&Frame) -> Result<()>) -> Result<()> {
        match self {
            Self::Frame(frame) => take(frame),
            Self::Stored(table) => table.chunks(take),
        }
    }
}

/// A field of a `reads!` struct whose table is read chunk by chunk.
pub struct Chunks<T>(InputTable, PhantomData<fn() -> T>);

impl<T: Table> Chunks<T> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.0.rows()
    }

    /// Hands on all rows in their order, chunk by chunk.
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

impl<T: Table> PortValue for Labelled<Chunks<T>> {
    const ARITY: Arity = Arity::One;
    const KIND: &'static str = T::KIND;
    const CHUNKED: bool = true;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        let all: Vec<Self> = PortValue::take(inputs)?;
        Ok(all.into_iter().next().expect("the plan wired this port"))
    }
}

impl<T: Table> PortValue for Vec<Labelled<Chunks<T>>> {
    const ARITY: Arity = Arity::Every;
    const KIND: &'static str = T::KIND;
    const CHUNKED: bool = true;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        let labelled = |(stage, input)| Labelled {
            stage,
            table: Chunks(input, PhantomData),
        };
        Ok(inputs.into_iter().map(labelled).collect())
    }
}
