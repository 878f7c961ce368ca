"""Readers and writers of input files: YAML and CSV. Each error is one line with file, field and remedy.

One module for each kind of file: ``robot_file`` (its fields; ``robot_library`` makes a ``Robot`` from it and from any
other file that describes an arm, ``robot_writer`` writes one), ``dh_table``, ``reference_sets``, ``target_file``,
``path_file``, ``program_file``, ``scene_file``, ``vision_file``, ``hand_eye_file``,
``factory_calibration``. Shared: ``yaml_file`` and
``csv_file`` (syntax), ``units`` (fields that detect the wrong unit), ``annotations`` (grades, translations),
``kept_files`` (atomic writes and locations). ``by_name``: functions of the library that take names of files.
"""
