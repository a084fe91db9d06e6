from gaitopt.parallel.dask_executor import DaskExecutor as DaskExecutor
from gaitopt.parallel.execution import Execution as Execution
