"""Reading files that people write: YAML and CSV, with one clear error naming file, field and remedy.

A module for each kind of file: ``robot_file`` (its fields; ``robot_library`` makes a ``Robot`` of it,
``robot_writer`` the way back), ``dh_table`` (and ``printed_table``), ``reference_sets``, ``target_file``,
``path_file``, ``program_file``, ``scene_file``, ``vision_file``, ``hand_eye_file``, ``pieces_file`` (from
``mesh_import``), ``factory_calibration``; ``arm_file`` takes any that describes an arm. What they share:
``yaml_file`` and ``csv_file`` (one error each), ``units`` (fields that catch the wrong unit), ``annotations``
(grades, translations), ``kept_files`` (where files stand). ``by_name``: the library's functions for names.
"""
