"""RViz's config files (``.rviz``), and objects whose settings are kept in them."""
