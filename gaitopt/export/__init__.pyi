from gaitopt.export.c_code import write_c as write_c
from gaitopt.export.csv_file import write_csv as write_csv
from gaitopt.export.library_module import write_library as write_library
from gaitopt.export.python_controller import write_python as write_python
from gaitopt.export.sweep_table import write_sweep_table as write_sweep_table
from gaitopt.export.torque_table import write_torques as write_torques
