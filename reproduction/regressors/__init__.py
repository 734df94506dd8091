"""Any regression technique: regressors of others, wrapped as they are, beside the same ones told everything."""
