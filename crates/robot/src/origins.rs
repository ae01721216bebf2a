//! Where in the text of a description file its links and joints are.

/// Positions of the elements of a description file, for the code that writes values back.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Origins {
    /// First byte of the element of each link; `None` for a link without an element of its own.
    pub links: Vec<Option<usize>>,
    /// First byte of the element of each joint; `None` for a joint without an element of its own.
    pub joints: Vec<Option<usize>>,
}
