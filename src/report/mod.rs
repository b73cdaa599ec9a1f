//! Tables to HTML.
