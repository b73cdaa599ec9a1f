//! Progress bars: the only file that knows a terminal.
