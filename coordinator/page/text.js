// Numbers and times for people.

const units = ['', ' k', ' M', ' G', ' T'];

export function count(number) {
  if (number === null || number === undefined) return '–';
  let unit = 0;
  for (; number >= 999.5 && unit < units.length - 1; unit++) number /= 1000;
  return (unit && number < 99.95 ? number.toFixed(1) : number.toFixed(0)) + units[unit];
}

export function duration(seconds) {
  if (seconds === null || seconds === undefined) return '–';
  const whole = Math.round(seconds);
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  if (hours) return `${hours} h ${minutes} min`;
  if (minutes) return `${minutes} min ${whole % 60} s`;
  return `${whole} s`;
}

export function percent(share) {
  return `${Math.floor(share * 100)} %`;
}

export function error(rmse) {
  if (rmse === null) return '–';
  if (rmse > 0 && rmse < 1e-4) return 'below 0.0001';
  return rmse > 0 ? rmse.toPrecision(3) : '0';
}

export function decibels(rmse) {
  return rmse >= 1e-4 ? `${(-20 * Math.log10(rmse)).toFixed(1)} dB` : '';
}

export function time(seconds) {
  return new Date(seconds * 1000).toLocaleTimeString([], {hour12: false});
}

// Sets the text of an element only where it changes, so that nothing is read out twice.
export function put(id, text) {
  const element = document.getElementById(id);
  if (element.textContent !== text) element.textContent = text;
}

// Golden-angle steps around the colour wheel: neighbours in number differ most.
export function colour(worker, alpha = 1) {
  return `hsl(${(worker * 137.508) % 360} 75% 50% / ${alpha})`;
}
