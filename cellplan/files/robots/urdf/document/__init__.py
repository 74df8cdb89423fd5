"""The text of a URDF: XML, xacro, and what is stated of links and joints."""
