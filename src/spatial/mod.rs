//! Pose, twist, exponential, adjoint and left Jacobian.
