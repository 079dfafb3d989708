% Octave's qp: octave-cli peer_qp.m PROBLEM RESULT (formats: qp_solvers.py, Program).
args = argv();
file = fopen(args{1}, "rb");
sizes = fread(file, 4, "double");
n = sizes(1); equal = sizes(2); m = sizes(3); repeats = sizes(4);
P = reshape(fread(file, n * n, "double"), n, n);
q = fread(file, n, "double");
G = reshape(fread(file, m * n, "double"), m, n);
h = fread(file, m, "double");
fclose(file);
options = optimset("MaxIter", 100000);
times = zeros(repeats, 1);
for k = 1:repeats
  tic;
  try
    [x, objective, info, lambda] = qp(zeros(n, 1), P, q, G(1:equal, :), h(1:equal), [], [], h(equal+1:end), ...
                                      G(equal+1:end, :), [], options);
    good = info.info == 0;
  catch
    x = nan(n, 1); lambda = nan(m, 1); good = 0;
  end
  times(k) = toc;
end
file = fopen(args{2}, "wb");
fwrite(file, [median(times); good; x; lambda(1:m)], "double");
fclose(file);
